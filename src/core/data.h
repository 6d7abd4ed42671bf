// SPDX-License-Identifier: Apache-2.0
// core/data: finds Catgut's data files at run time, so that program and library can be moved.
#pragma once
#include <string>

namespace catgut {

// The path of `name` ("scenes") among Catgut's own files, empty when there is none. The first of:
//   CATGUT_DATA_DIR/name, from the environment;
//   share/catgut/name in the folder of the running program or in one above it (a build folder, an unpacked package);
//   catgut/name in XDG_DATA_HOME (else ~/.local/share), then in each of XDG_DATA_DIRS (else /usr/local/share:/usr/share);
//   share/catgut/name in the prefix for which the library was configured.
std::string data_path(const std::string& name);

// The path of `name` ("fonts/truetype/...") among files that programs share: the same folders, without "catgut/".
std::string shared_path(const std::string& name);

}  // namespace catgut

// SPDX-License-Identifier: Apache-2.0
// core/file: reads and writes whole files at once. A reader sees the old file or the new one, never a part of it.
#pragma once
#include <string>
#include <string_view>

namespace catgut {

// Writes `bytes` to a temporary file beside `path`, flushes it to the disk and renames it. An existing regular file keeps its
// old content until the new content is complete. A path that exists and is not a regular file (a pipe, a device) is written
// directly. Throws InputError when anything fails (no folder, no permission, disk full); no partial file remains.
void write_file(const std::string& path, std::string_view bytes);
// The whole file. Throws InputError if it cannot be read, or is a folder.
std::string read_file(const std::string& path);

// Throws InputError unless `path` is empty or ends in `suffix` (with its dot; case is ignored). option: for the message.
void check_suffix(const std::string& path, std::string_view suffix, const std::string& option);

}  // namespace catgut

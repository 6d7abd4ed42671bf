// SPDX-License-Identifier: Apache-2.0
// device/drivers: see the header. A new driver is a line here.
#include "device/drivers.h"

#include "device/bridge.h"
#include "device/force_dimension.h"
#include "device/haply.h"
#include "device/touch.h"

namespace catgut {
namespace {

constexpr ArmDriver kDrivers[] = {
#ifdef CATGUT_WITH_HAPTICS
    {"touch", "3D Systems Touch", "path of libHD.so, or device names RIGHT,LEFT",
     [](const std::string& where, std::vector<std::string>& messages) {
       TouchOptions o;
       if (const size_t comma = where.find(','); comma != std::string::npos)
         o.name = {where.substr(0, comma), where.substr(comma + 1)};
       else o.library = where;
       return open_touch(o, messages);
     }},
    {"force-dimension", "Force Dimension omega, delta, lambda, sigma; Novint Falcon", "path of libdhd.so",
     [](const std::string& where, std::vector<std::string>& messages) {
       ForceDimensionOptions o;
       o.library = where;
       return open_force_dimension(o, messages);
     }},
    {"haply", "Haply Inverse3 and Minverse", "HOST[:PORT]",
     [](const std::string& where, std::vector<std::string>& messages) {
       HaplyOptions o;
       o.where = where;
       return open_haply(o, messages);
     }},
#endif
    {"bridge", "devices of another machine or program", "HOST[:PORT]",
     [](const std::string& where, std::vector<std::string>& messages) {
       BridgeOptions o;
       o.where = where;
       return open_bridge(o, messages);
     }},
};

}  // namespace

std::span<const ArmDriver> arm_drivers() { return kDrivers; }

}  // namespace catgut

// Keeps what nobody here asked for out of this process. Every process of a multicast group receives every
// message: in a run of six processes those wake-ups cost more than the physics. Anybody can send to the port,
// too, also from other machines. The kernel can tell by itself.
#pragma once

#include <span>
#include <string>

namespace evalbus {

// Attaches to a UDP socket a filter that drops what is no LCM message (bus/lcm_wire.h), what comes from
// another machine if `is_local`, fragments beyond the end of their message or of one larger than so many can
// hold, and messages on other channels than these; a name that ends in ".*" stands for all that begin so, no
// channels at all for every channel. Of a message in fragments only the first one names its channel: the
// others pass. The socket of a kernel that has no such filters stays as it is.
void FilterChannels(int fd, bool is_local, std::span<const std::string> channels);

}  // namespace evalbus

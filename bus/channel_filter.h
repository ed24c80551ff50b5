// Keeps what nobody here asked for out of this process. Every process of a multicast group receives every
// message, and liblcm wakes a thread for each before it looks at the channel: in a run of six processes those
// wake-ups cost more than the physics. Anybody can send to the port, too, also from other machines, and
// liblcm writes where a fragment says without looking whether that is in its buffer. The kernel can tell by
// itself.
#pragma once

#include <span>
#include <string>

namespace evalbus {

// Attaches to each UDP socket of this process that is bound to the port a socket filter that drops what is no
// LCM message, what comes from another machine if `is_local`, fragments beyond the end of their message or of
// one larger than so many can hold, and messages on other channels than these; no channels at all stands for
// every channel. Fragments of large messages pass whatever their channel. Sockets of a kernel that has no
// such filters stay as they are.
void FilterChannels(int port, bool is_local, std::span<const std::string> channels);

}  // namespace evalbus

// Keeps messages that nobody here asked for out of this process. Every process of a multicast group receives
// every message, and liblcm wakes a thread for each before it looks at the channel: in a run of six processes
// those wake-ups cost more than the physics. The kernel can tell by itself.
#pragma once

#include <span>
#include <string>

namespace evalbus {

// Attaches to each UDP socket of this process that is bound to the port a socket filter that drops LCM
// messages on other channels; no channels at all takes the filter away. Fragments of large messages pass.
// Sockets that refuse the filter stay as they are: it saves time only.
void FilterChannels(int port, std::span<const std::string> channels);

}  // namespace evalbus

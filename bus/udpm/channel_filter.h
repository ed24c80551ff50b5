// Drops unsubscribed channels in the kernel, before they wake this process. Every process of a multicast
// group receives every message: in a run of six processes, those wake-ups cost more than the physics.
// Programs outside the run can also send to the port, even from other machines.
#pragma once

#include <span>
#include <string>

namespace evalbus {

// Attaches a filter to a UDP socket. The filter drops
//   - datagrams that do not begin as LCM messages (bus/udpm/lcm_wire.h),
//   - datagrams from other machines, if `is_local`,
//   - fragments whose message size or offset is above kMaxMessageBytes,
//   - first fragments with an offset other than 0,
//   - fragments of a message that is larger than its number of fragments can hold,
//   - messages on channels that are not in `channels`.
//
// A name in `channels` that ends in ".*" matches all channels with that prefix; an empty list accepts every
// channel. Only the first fragment of a message contains the channel's name, so later fragments pass. If the
// kernel does not support such filters, the socket remains unfiltered.
void FilterChannels(int fd, bool is_local, std::span<const std::string> channels);

}  // namespace evalbus

#include "bus/wake_event.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "base/errors.h"

namespace evalbus {

WakeEvent::WakeEvent() : fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (fd_ < 0) throw EnvironmentError(std::string("cannot create an eventfd: ") + std::strerror(errno));
}

WakeEvent::~WakeEvent() { close(fd_); }

// A failure of either call on this non-blocking eventfd is harmless. At the maximum count, the event is
// already set; at zero, it is already clear.
void WakeEvent::Set() { (void)!eventfd_write(fd_, 1); }

void WakeEvent::Clear() {
  eventfd_t count = 0;
  (void)!eventfd_read(fd_, &count);
}

}  // namespace evalbus

// Combines several functions into one object with overloads, for std::visit and channels::Dispatch.
#pragma once

namespace evalbus {

template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
// Clang 14 needs this deduction guide.
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

}  // namespace evalbus

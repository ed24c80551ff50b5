// An array as the bytes of a NumPy file (.npy), which GR00T's servers put into their messages.
// Format: numpy.lib.format of NumPy's documentation, versions 1.0 and 2.0.
#pragma once

#include <span>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Version 1.0; the numbers begin at a multiple of 64 bytes.
Bytes EncodeNpy(const Array& array);

// Throws ServerError (kProtocol) for what is no such file, for numbers in Fortran's order and for Python
// objects.
Array DecodeNpy(std::span<const uint8_t> bytes);

}  // namespace evalbus::policy

// NumPy files (.npy), which GR00T's servers embed in their messages. The format (versions 1.0 and 2.0) is
// described under numpy.lib.format in NumPy's documentation.
#pragma once

#include <span>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Encodes version 1.0 of the format. The numbers start at a multiple of 64 bytes.
Bytes EncodeNpy(const Array& array);

// Throws ServerError (kProtocol) if the bytes are not a .npy file, and if it contains Fortran order or Python
// objects.
Array DecodeNpy(std::span<const uint8_t> bytes);

}  // namespace evalbus::policy

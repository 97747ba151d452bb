// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/hash.h"

#include <fmt/format.h>
#include <openssl/sha.h>

#include <array>

namespace brdfc::inline core {

std::string sha256(const std::string& bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest;
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest.data());
  std::string hex;
  for (unsigned char byte : digest) hex += fmt::format("{:02x}", byte);
  return hex;
}

}  // namespace brdfc::inline core

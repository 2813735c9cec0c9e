// Writing SBET and SMRMSG.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/io/sbet.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <string>

namespace liealign {
namespace {

template <typename Record>
void append_little_endian(std::string& out, const Record& record) {
  std::array<char, sizeof(Record)> raw;
  std::memcpy(raw.data(), &record, sizeof(Record));
  if constexpr (std::endian::native == std::endian::big) {
    for (std::size_t i = 0; i < raw.size(); i += sizeof(double))
      std::reverse(raw.begin() + static_cast<std::ptrdiff_t>(i),
                   raw.begin() + static_cast<std::ptrdiff_t>(i + sizeof(double)));
  }
  out.append(raw.data(), raw.size());
}

}  // namespace

void append_sbet(std::string& out, const SbetRecord& record) { append_little_endian(out, record); }

void append_smrmsg(std::string& out, const SmrmsgRecord& record) { append_little_endian(out, record); }

}  // namespace liealign

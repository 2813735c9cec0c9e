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

constexpr std::size_t kBlockBytes = std::size_t{1} << 18;

template <typename Record>
void append_little_endian(const Record& record, std::string& bytes) {
  std::array<char, sizeof(Record)> raw;
  std::memcpy(raw.data(), &record, sizeof(Record));
  if constexpr (std::endian::native == std::endian::big) {
    for (std::size_t i = 0; i < raw.size(); i += sizeof(double))
      std::reverse(raw.begin() + static_cast<std::ptrdiff_t>(i),
                   raw.begin() + static_cast<std::ptrdiff_t>(i + sizeof(double)));
  }
  bytes.append(raw.data(), raw.size());
}

template <typename Record>
void write_records(PartFile& file, std::size_t n, const std::function<Record(std::size_t)>& fill) {
  std::string bytes;
  for (std::size_t i = 0; i < n; ++i) {
    append_little_endian(fill(i), bytes);
    if (bytes.size() < kBlockBytes && i + 1 < n) continue;
    file.write(bytes);
    bytes.clear();
  }
}

}  // namespace

void write_sbet(PartFile& file, std::size_t n, const std::function<SbetRecord(std::size_t)>& fill) {
  write_records<SbetRecord>(file, n, fill);
}

void write_smrmsg(PartFile& file, std::size_t n, const std::function<SmrmsgRecord(std::size_t)>& fill) {
  write_records<SmrmsgRecord>(file, n, fill);
}

}  // namespace liealign

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

template <typename Record>
void write_records(PartFile& file, std::size_t n, const std::function<Record(std::size_t)>& fill) {
  std::string bytes;
  bytes.reserve(kBlockBytes + sizeof(Record));
  for (std::size_t i = 0; i < n; ++i) {
    append_little_endian(bytes, fill(i));
    if (bytes.size() < kBlockBytes && i + 1 < n) continue;
    file.write(bytes);
    bytes.clear();
  }
}

}  // namespace

void append_sbet(std::string& out, const SbetRecord& record) { append_little_endian(out, record); }

void append_smrmsg(std::string& out, const SmrmsgRecord& record) { append_little_endian(out, record); }

void write_sbet(PartFile& file, std::size_t n, const std::function<SbetRecord(std::size_t)>& fill) {
  write_records<SbetRecord>(file, n, fill);
}

void write_smrmsg(PartFile& file, std::size_t n, const std::function<SmrmsgRecord(std::size_t)>& fill) {
  write_records<SmrmsgRecord>(file, n, fill);
}

}  // namespace liealign

// Whole text files: read in one go, written through a .part file and a rename.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/io/text_file.hpp"

#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <system_error>

#include "liealign/core/error.hpp"

namespace liealign {
namespace {

constexpr std::size_t kFirstRead = std::size_t{1} << 16;

[[noreturn]] void fail(const std::string& path, const char* what, int error_number) {
  throw InputError(path + ": " + what + ": " + std::generic_category().message(error_number));
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

std::string read_text_file(const std::string& path) {
  const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "rb"));
  if (!file) fail(path, "cannot be read", errno);

  // The size on disk is only a first guess: pipes have none, and a log may still be growing.
  std::error_code no_size;
  const std::uintmax_t size_on_disk = std::filesystem::file_size(path, no_size);
  std::string text(no_size ? kFirstRead : static_cast<std::size_t>(size_on_disk) + 1, '\0');
  std::size_t used = 0;
  while (const std::size_t got = std::fread(text.data() + used, 1, text.size() - used, file.get())) {
    used += got;
    if (used == text.size()) text.resize(2 * used);
  }
  if (std::ferror(file.get()) != 0) fail(path, "cannot be read", errno);
  text.resize(used);
  return text;
}

void write_text_file(const std::string& path, std::string_view text) {
  PartFile file(path);
  file.write(text);
  file.commit();
}

PartFile::PartFile(const std::string& path)
    : path_(path), part_path_(path + ".part"), file_(std::fopen(part_path_.c_str(), "wb")) {
  if (file_ == nullptr) fail(path_, "cannot be written", errno);
}

PartFile::~PartFile() {
  if (file_ != nullptr) std::fclose(file_);
  if (committed_) return;
  std::error_code ignored;  // nothing better to do with a part that cannot be removed
  std::filesystem::remove(part_path_, ignored);
}

void PartFile::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail(path_, "cannot be written", errno);
}

void PartFile::finish() {
  std::FILE* const file = file_;
  file_ = nullptr;
  if (file != nullptr && std::fclose(file) != 0) fail(path_, "cannot be written", errno);  // a full disk shows here
}

void PartFile::commit() {
  finish();
  std::error_code error;
  std::filesystem::rename(part_path_, path_, error);
  if (error) throw InputError(path_ + ": cannot be written: " + error.message());
  committed_ = true;
}

}  // namespace liealign

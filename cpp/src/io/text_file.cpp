// Text files: read in one go or a block at a time, written through a .part file and a rename.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/io/text_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <system_error>

#include "liealign/core/error.hpp"

namespace liealign {
namespace {

constexpr std::size_t kFirstRead = std::size_t{1} << 16;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

[[noreturn]] void fail(const std::string& path, const char* what, int error_number) {
  throw InputError(path + ": " + what + ": " + std::generic_category().message(error_number));
}

using File = std::unique_ptr<std::FILE, CloseFile>;

File open_to_read(const std::string& path) {
  File file(std::fopen(path.c_str(), "rb"));
  if (!file) fail(path, "cannot be read", errno);
  return file;
}

}  // namespace

std::string read_text_file(const std::string& path) {
  const File file = open_to_read(path);

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

TextLines::TextLines(const std::string& path) : path_(path), file_(open_to_read(path)), block_(kBlock, '\0') {
  std::error_code no_size;  // of a pipe
  const std::uintmax_t size_on_disk = std::filesystem::file_size(path, no_size);
  if (!no_size) size_ = static_cast<double>(size_on_disk);
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);  // the block is the buffer
  read_more();
  if (std::string_view(block_.data(), end_).starts_with(kByteOrderMark)) begin_ = kByteOrderMark.size();
}

// Moves what is not yet given to the front and fills the block behind it; one line may be longer than the block.
// False at the end of the file.
bool TextLines::read_more() {
  std::copy(block_.begin() + static_cast<std::ptrdiff_t>(begin_), block_.begin() + static_cast<std::ptrdiff_t>(end_),
            block_.begin());
  end_ -= begin_;
  begin_ = 0;
  if (end_ == block_.size()) block_.resize(2 * block_.size());
  const std::size_t got = std::fread(block_.data() + end_, 1, block_.size() - end_, file_.get());
  if (std::ferror(file_.get()) != 0) fail(path_, "cannot be read", errno);
  end_ += got;
  bytes_ += got;
  return got > 0;
}

bool TextLines::next(std::string_view& line) {
  const auto rest = [&] { return std::string_view(block_).substr(begin_, end_ - begin_); };
  std::size_t searched = 0;
  std::size_t length = rest().find('\n');
  while (length == std::string_view::npos) {
    searched = end_ - begin_;
    if (!read_more()) break;
    length = rest().find('\n', searched);
  }
  if (begin_ == end_) return false;
  cut_off_ = length == std::string_view::npos;
  line = rest().substr(0, length);
  begin_ += line.size() + (cut_off_ ? 0 : 1);
  ++number_;
  return true;
}

double TextLines::share_given() const {
  return size_ > 0.0 ? std::min(1.0, static_cast<double>(bytes_ - (end_ - begin_)) / size_) : 0.0;
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

// Text files: read in one go or line by line, written so that a reader sees the complete new file or none.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace liealign {

// The bytes of the file, unchanged. Throws InputError `path: cannot be read: reason`.
std::string read_text_file(const std::string& path);

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

// The lines of a file or pipe, of which a block at a time is in memory. A byte order mark at the beginning is left out.
// Every member that reads throws InputError `path: cannot be read: reason`.
class TextLines {
 public:
  static constexpr std::size_t kBlock = std::size_t{1} << 18;

  explicit TextLines(const std::string& path);

  // The next line without its '\n', or false after the last one. The view holds until the next call.
  bool next(std::string_view& line);

  std::size_t number() const { return number_; }  // of the line given last, counted from 1
  bool cut_off() const { return cut_off_; }       // the file ends within the line given last: it has no '\n'

  // What part of the file has been given, or 0 where its size is not known.
  double share_given() const;

 private:
  bool read_more();

  std::string path_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  std::string block_;
  std::size_t begin_ = 0;  // of what is not yet given, in block_
  std::size_t end_ = 0;    // of what has been read into block_
  std::size_t bytes_ = 0;  // read so far
  double size_ = 0.0;      // of the file
  std::size_t number_ = 0;
  bool cut_off_ = false;
};

// Makes room in a vector that takes an item from each line for those of the whole file, at the length of the lines so
// far. Doubling would hold half as much again while it moves the items.
template <typename Item>
void make_room(std::vector<Item>& items, const TextLines& lines) {
  constexpr std::size_t kEnoughToTell = 1000;
  constexpr double kMargin = 1.05;  // lines may become shorter
  if (items.size() < items.capacity() || items.size() < kEnoughToTell || lines.share_given() == 0.0) return;
  items.reserve(static_cast<std::size_t>(kMargin * static_cast<double>(items.size()) / lines.share_given()) + 1);
}

// Replaces the file by `text`, bytes unchanged. Throws InputError `path: cannot be written: reason`.
void write_text_file(const std::string& path, std::string_view text);

// A file being written. The bytes go to `path + ".part"`; commit() renames it to `path`. Without a commit
// (an exception on the way) the part is removed and whatever stood at `path` before is untouched. Files that belong
// together are finished one and all, which shows a full disk, before the first is committed.
// Every member throws InputError `path: cannot be written: reason`.
class PartFile {
 public:
  explicit PartFile(const std::string& path);
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  void write(std::string_view bytes);
  void finish();  // nothing more to write
  void commit();  // finishes what is not

 private:
  std::string path_;
  std::string part_path_;
  std::FILE* file_ = nullptr;
  bool committed_ = false;
};

}  // namespace liealign

// Whole text files: read in one go, written so that a reader sees the complete new file or none.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

namespace liealign {

// The bytes of the file, unchanged. Throws InputError `path: cannot be read: reason`.
std::string read_text_file(const std::string& path);

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

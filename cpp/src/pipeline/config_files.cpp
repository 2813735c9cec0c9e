// File names in a configuration, from and to FLIGHT.toml.
// SPDX-License-Identifier: Apache-2.0
#include "liealign/pipeline/config_files.hpp"

#include <filesystem>
#include <system_error>

namespace liealign {
namespace {

namespace fs = std::filesystem;

// Applies `rename` to every file name that is given.
template <typename Rename>
Config renamed(Config config, const Rename& rename) {
  for (std::string* name : {&config.imu.file, &config.gnss.file, &config.baro.file}) {
    if (!name->empty()) *name = rename(*name);
  }
  return config;
}

fs::path without_dots(const fs::path& path) {
  fs::path plain;
  for (const fs::path& part : path) {
    if (!part.empty() && part != ".") plain /= part;
  }
  return plain.empty() ? fs::path(".") : plain;
}

// Absolute, with the links of its existing part resolved; where the system refuses that, by its text alone.
fs::path resolved(const fs::path& path) {
  std::error_code failure;
  const fs::path absolute = fs::absolute(without_dots(path), failure);
  if (failure) return path.lexically_normal();
  const fs::path canonical = fs::weakly_canonical(absolute, failure);
  return failure ? absolute.lexically_normal() : canonical;
}

}  // namespace

std::string plain_path(const std::string& path) { return without_dots(path).string(); }

Config files_from(const std::string& toml, const Config& config) {
  const fs::path folder = fs::path(toml).parent_path();
  return renamed(config, [&](const std::string& name) { return without_dots(folder / name).string(); });
}

Config files_relative_to(const std::string& folder, const Config& config) {
  const fs::path from = resolved(folder);
  return renamed(config, [&](const std::string& name) {
    const fs::path to = resolved(name);
    const fs::path relative = to.lexically_relative(from);  // empty on another drive
    return (relative.empty() ? to : relative).generic_string();
  });
}

}  // namespace liealign

// File names in a configuration: in FLIGHT.toml they are relative to its folder, in a run to the working directory.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "liealign/pipeline/config.hpp"

namespace liealign {

// A path as messages show it: without "." and doubled separators; ".." stays, for links. "." for an empty one.
std::string plain_path(const std::string& path);

// The configuration as read from the file `toml`, with its file names put behind the folder of that file.
Config files_from(const std::string& toml, const Config& config);

// The same configuration, to be written into `folder`: file names are relative to it, links resolved, with "/".
Config files_relative_to(const std::string& folder, const Config& config);

}  // namespace liealign

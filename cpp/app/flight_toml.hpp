// FLIGHT.toml for liealign-post: toml++ reads the text, the field table does the rest.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "liealign/pipeline/config.hpp"

namespace liealign::app {

// The configuration in the file, its file names put behind its folder. Throws InputError when the file cannot be read,
// ConfigError `file:line:column: ...` when it is not valid TOML or a key or value cannot be used.
Config read_flight_toml(const std::string& file);

}  // namespace liealign::app

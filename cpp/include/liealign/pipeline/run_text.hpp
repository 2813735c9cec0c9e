// What a front end prints of a run: the verdict first, then what a user would check.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "liealign/pipeline/results.hpp"

namespace liealign {

struct TextLine {
  std::string label;
  std::string text;
};

// The heading, its sigma, its time and verdict, and the warnings.
std::vector<TextLine> alignment_text(const PreparedFlight& flight, const HeadingResult& heading,
                                     const ReceiverFit* receiver = nullptr);

// The same, what became of the fixes, how good the trajectory is, and where it is.
std::vector<TextLine> run_text(const PreparedFlight& flight, const HeadingResult& heading, const Solution& solution,
                               const std::string& folder);

}  // namespace liealign

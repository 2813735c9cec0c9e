// A user of the installed library: headers, templates, the archive and its own dependencies.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <liealign/align/candidates.hpp>
#include <liealign/earth/geodesy.hpp>
#include <liealign/pipeline/config.hpp>

int main() {
  const liealign::Vector3d p_e = liealign::ecef_from_geodetic({0.0, 0.0, 100.0});
  const bool evaluates = liealign::evaluate_candidates({}, {}).empty();  // OpenMP is linked
  std::printf("liealign %s: %.1f m, %zu keys\n", LIEALIGN_VERSION, p_e[0], liealign::config_fields().size());
  return p_e[0] == 6378237.0 && evaluates ? 0 : 1;
}

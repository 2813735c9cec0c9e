// Laws of the ranking of filters by the rms of their innovations, (Eq. 34).
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "flights.hpp"
#include "liealign/align/ranking.hpp"
#include "liealign/core/error.hpp"
#include "liealign/core/units.hpp"

namespace liealign {
namespace {

using namespace testing;

std::vector<FixInnovation> series(std::initializer_list<FixInnovation> fixes) { return fixes; }

TEST(Ranking, the_rms_is_over_the_rows_that_every_filter_has_seen) {
  const std::vector<RankedFilter> ranked = rank_by_p_rms(
      {series({{1, 9.0}, {2, 3.0}, {3, 4.0}, {7, 1.0}}), series({{2, 1.0}, {3, 1.0}, {4, 90.0}, {7, 2.0}}), series({})},
      0, 6);
  ASSERT_EQ(ranked.size(), 3u);
  EXPECT_EQ(ranked[0].filter, 1u);
  EXPECT_DOUBLE_EQ(ranked[0].p_rms_m, 1.0);
  EXPECT_EQ(ranked[0].fixes, 2u);
  EXPECT_EQ(ranked[1].filter, 0u);
  EXPECT_DOUBLE_EQ(ranked[1].p_rms_m, std::sqrt(12.5));
  EXPECT_EQ(ranked[1].fixes, 2u);
  EXPECT_EQ(ranked[2].filter, 2u);  // it failed
  EXPECT_TRUE(std::isinf(ranked[2].p_rms_m));
  EXPECT_EQ(ranked[2].fixes, 0u);
}

TEST(Ranking, equals_keep_their_order_and_nothing_in_common_is_refused) {
  const std::vector<RankedFilter> ranked = rank_by_p_rms({series({{0, 1.0}}), series({{0, -1.0}})});
  EXPECT_EQ(ranked[0].filter, 0u);
  EXPECT_EQ(ranked[1].filter, 1u);
  EXPECT_TRUE(rank_by_p_rms({}).empty());
  EXPECT_THROW(rank_by_p_rms({series({{0, 1.0}}), series({{1, 1.0}})}), Error);
  EXPECT_THROW(rank_by_p_rms({series({{0, 1.0}})}, 1), Error);
}

// Innovations of the bank are those its score is made of.
TEST(Ranking, the_innovations_of_a_candidate_have_the_p_rms_of_its_score) {
  const SimulatedFlight simulated = table_1_flight(30.0, 3);
  PreparedFlight prepared = prepare_flight(simulated.flight);
  prepared.problem.intervals = {};  // sample by sample, as the innovations are found
  const HeadingCandidate candidate{30.0 * kDegToRad, 0.02, false, {}};
  const std::vector<FixInnovation> fixes = fix_innovations(prepared.problem, candidate);
  const CandidateScore score = evaluate_candidates(prepared.problem, {candidate}).front();
  EXPECT_EQ(fixes.size(), score.fixes);
  EXPECT_NEAR(rank_by_p_rms({fixes}).front().p_rms_m, score.p_rms_m, 1e-12);
}

// Each of them alone wrong, the others right: the true set of parameters predicts best.
TEST(Ranking, the_true_parameters_come_first) {
  GnssErrors errors;
  errors.latency_s = 0.12;
  Config truth;
  truth.gnss.latency_s = errors.latency_s;
  const SimulatedFlight simulated = table_1_flight(200.0, 11, truth, errors);
  std::vector<Config> configs(6, simulated.flight.config);
  configs[1].gnss.lever_arm_b_m[0] += 0.15;
  configs[2].gnss.lever_arm_b_m[1] -= 0.15;
  configs[3].gnss.latency_s = 0.0;
  configs[4].gnss.latency_s = 0.17;
  std::vector<std::vector<FixInnovation>> filters;
  for (std::size_t i = 0; i < configs.size(); ++i) {
    Flight flight = simulated.flight;
    flight.config = configs[i];
    const double heading_deg = i == 5 ? 195.0 : 200.0;
    filters.push_back(
        fix_innovations(prepare_flight(flight).problem, {heading_deg * kDegToRad, 0.5 * kDegToRad, true, {}}));
  }
  const std::vector<RankedFilter> ranked = rank_by_p_rms(filters);
  EXPECT_EQ(ranked.front().filter, 0u);
  EXPECT_GT(ranked[1].p_rms_m, 1.05 * ranked[0].p_rms_m);
  for (const RankedFilter& r : ranked) EXPECT_EQ(r.fixes, ranked[0].fixes);
}

}  // namespace
}  // namespace liealign

// From the configuration, in the units its keys name, to the settings of the floors below, in SI.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "liealign/align/heading_search.hpp"
#include "liealign/align/rest.hpp"
#include "liealign/ins/prepare_imu.hpp"
#include "liealign/pipeline/config.hpp"

namespace liealign {

struct FilterOptions;  // of estimate/forward.hpp
struct OutputFrame;    // of estimate/output_frame.hpp

// "auto" until the flight itself is asked: latency 0, both scales 1.
inline constexpr double kUnestimatedLatency_s = 0.0;
inline constexpr double kUnestimatedScale = 1.0;

// Noise densities of the profile, overridden key by key, times imu.noise_scale. q_b = 2 sigma^2 / tau_c.   (Eq. 23)
ImuNoise imu_noise(const Config& config);

InitialStd initial_std(const Config& config);
FilterOptions filter_options(const Config& config);
RestNoise rest_noise(const Config& config);
RestLimits rest_limits(const Config& config);
HeadingSearchOptions heading_search_options(const Config& config);

ImuSampleKind sample_kind(const Config& config);

// The point and the axes whose trajectory is wanted.
OutputFrame output_frame(const Config& config);

// Sensor axes to body: imu.axes, then imu.mounting_rpy_deg.
Matrix3d sensor_to_body(const Config& config);

}  // namespace liealign

// The density of the heading, (Eq. 61)-(Eq. 62).
// SPDX-License-Identifier: Apache-2.0
#include "liealign/align/heading_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "liealign/core/units.hpp"

namespace liealign {

double wrap_pi(double angle_rad) { return angle_rad - 2.0 * kPi * std::ceil(angle_rad / (2.0 * kPi) - 0.5); }

double wrap_2pi(double angle_rad) {
  const double wrapped = angle_rad - 2.0 * kPi * std::floor(angle_rad / (2.0 * kPi));
  return wrapped < 2.0 * kPi ? wrapped : 0.0;
}

namespace {

// Between two samples: the density is d0 exp(-rise x), x from 0 to 1, over a width.
struct Piece {
  double from, width, density, rise;

  // Integral over the first x of it.
  double mass(double x = 1.0) const {
    const double r = rise * x;
    const double mean = std::abs(r) < 1e-6 ? 1.0 - 0.5 * r : -std::expm1(-r) / r;
    return density * width * x * mean;
  }
  // Where the integral reaches m.
  double at(double m) const {
    const double flat = m / (density * width);
    const double x = std::abs(rise) < 1e-6 ? flat : -std::log1p(-std::min(flat * rise, 1.0 - 1e-15)) / rise;
    return from + width * std::clamp(x, 0.0, 1.0);
  }
};

std::vector<Piece> pieces_of(const std::vector<PosteriorSample>& samples, double lowest) {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const PosteriorSample& a = samples[i];
    const bool last = i + 1 == samples.size();
    const PosteriorSample& b = last ? samples[0] : samples[i + 1];
    const double width = b.heading_rad - a.heading_rad + (last ? 2.0 * kPi : 0.0);
    // Beyond 700 nats a density is zero, and an infinite cost leaves no other slope.
    const double cost = std::min(a.cost - lowest, 700.0), next = std::min(b.cost - lowest, 700.0);
    pieces.push_back({a.heading_rad, width, std::exp(-cost), next - cost});
  }
  return pieces;
}

// Headings from the antipode of psi on, so that the interval about psi is one piece.
double quantile(const std::vector<Piece>& pieces, double psi, double share, double total) {
  const double cut = psi - kPi;
  std::vector<Piece> turned;
  for (Piece p : pieces) {
    p.from = cut + wrap_2pi(p.from - cut);
    const double beyond = p.from + p.width - (cut + 2.0 * kPi);
    if (beyond > 0.0) {  // the piece that the antipode cuts in two
      const double x = 1.0 - beyond / p.width;
      turned.push_back({cut, beyond, p.density * std::exp(-p.rise * x), p.rise * (1.0 - x)});
      p = {p.from, p.width - beyond, p.density, p.rise * x};
    }
    turned.push_back(p);
  }
  std::sort(turned.begin(), turned.end(), [](const Piece& a, const Piece& b) { return a.from < b.from; });
  double sum = 0.0;
  for (const Piece& p : turned) {
    const double mass = p.mass();
    if (sum + mass >= share * total) return p.at(share * total - sum);
    sum += mass;
  }
  return cut + 2.0 * kPi;
}

// A peak and the ridge, the highest cost, on the way to the next peak.
struct Peak {
  std::size_t at, ridge;
};

std::vector<Peak> peaks_of(const std::vector<PosteriorSample>& samples) {
  const std::size_t n = samples.size();
  std::vector<Peak> peaks;
  for (std::size_t i = 0; i < n; ++i) {
    if (samples[i].cost < samples[(i + n - 1) % n].cost && samples[i].cost <= samples[(i + 1) % n].cost)
      peaks.push_back({i, i});
  }
  for (std::size_t m = 0; peaks.size() > 1 && m < peaks.size(); ++m) {
    const std::size_t next = peaks[(m + 1) % peaks.size()].at;
    for (std::size_t i = peaks[m].at; i != next; i = (i + 1) % n) {
      if (samples[i].cost > samples[peaks[m].ridge].cost) peaks[m].ridge = i;
    }
  }
  return peaks;
}

// Peaks that hardly a ridge parts are one.
void merge_peaks(const std::vector<PosteriorSample>& samples, std::vector<Peak>& peaks) {
  constexpr double kRidge = 0.5;  // nats above the lesser of the two
  for (std::size_t m = 0; peaks.size() > 1 && m < peaks.size();) {
    const std::size_t next = (m + 1) % peaks.size();
    const double a = samples[peaks[m].at].cost, b = samples[peaks[next].at].cost;
    if (samples[peaks[m].ridge].cost > std::max(a, b) + kRidge) {
      ++m;
      continue;
    }
    peaks[m] = {a <= b ? peaks[m].at : peaks[next].at, peaks[next].ridge};
    peaks.erase(peaks.begin() + static_cast<std::ptrdiff_t>(next));
    m = 0;
  }
}

// The least set of headings that holds `share`: pieces by their mean density, the last one in part.
double least_width(std::vector<Piece> pieces, double share, double total) {
  std::sort(pieces.begin(), pieces.end(),
            [](const Piece& a, const Piece& b) { return a.mass() / a.width > b.mass() / b.width; });
  double sum = 0.0, width = 0.0;
  for (const Piece& p : pieces) {
    const double mass = p.mass(), wanted = share * total - sum;
    if (mass >= wanted) return width + p.width * wanted / mass;
    sum += mass;
    width += p.width;
  }
  return width;
}

std::vector<HeadingMode> modes_of(const std::vector<PosteriorSample>& samples, const std::vector<Piece>& pieces,
                                  double total) {
  std::vector<Peak> peaks = peaks_of(samples);
  merge_peaks(samples, peaks);
  if (peaks.empty()) return {{samples[0].heading_rad, 1.0}};  // a flat circle
  if (peaks.size() == 1) return {{samples[peaks[0].at].heading_rad, 1.0}};
  std::vector<HeadingMode> modes;
  for (std::size_t m = 0; m < peaks.size(); ++m) {
    HeadingMode mode{samples[peaks[m].at].heading_rad, 0.0};
    const std::size_t from = peaks[(m + peaks.size() - 1) % peaks.size()].ridge;
    for (std::size_t i = from; i != peaks[m].ridge; i = (i + 1) % samples.size()) mode.mass += pieces[i].mass() / total;
    modes.push_back(mode);
  }
  std::stable_sort(modes.begin(), modes.end(),
                   [](const HeadingMode& a, const HeadingMode& b) { return a.mass > b.mass; });
  return modes;
}

}  // namespace

HeadingPosterior heading_posterior(std::vector<PosteriorSample> samples, double psi_rad) {
  double lowest = std::numeric_limits<double>::infinity();
  for (PosteriorSample& s : samples) {
    s.heading_rad = wrap_2pi(s.heading_rad);
    if (!std::isfinite(s.cost)) s.cost = std::numeric_limits<double>::max();
    lowest = std::min(lowest, s.cost);
  }
  std::stable_sort(samples.begin(), samples.end(),
                   [](const PosteriorSample& a, const PosteriorSample& b) { return a.heading_rad < b.heading_rad; });
  const std::vector<Piece> pieces = pieces_of(samples, lowest);
  double total = 0.0;
  std::complex<double> resultant = 0.0;
  for (const Piece& p : pieces) {
    const double mass = p.mass();
    total += mass;
    resultant += mass * std::polar(1.0, p.at(0.5 * mass));
  }
  HeadingPosterior out;
  // About psi, so that the rounding of a sum over the circle does not reach a sigma of millidegrees.
  double shift = 0.0;
  if (std::abs(resultant) > 0.9 * total) {
    for (const Piece& p : pieces) shift += p.mass() / total * wrap_pi(p.at(0.5 * p.mass()) - psi_rad);
    out.mean_rad = wrap_2pi(psi_rad + shift);
  } else {
    out.mean_rad = wrap_2pi(std::arg(resultant));
  }
  constexpr double kEachSide = 0.025;
  out.low_rad = quantile(pieces, psi_rad, kEachSide, total);
  out.high_rad = quantile(pieces, psi_rad, 1.0 - kEachSide, total);
  out.width_rad = least_width(pieces, 1.0 - 2.0 * kEachSide, total);
  out.modes = modes_of(samples, pieces, total);
  for (PosteriorSample& s : samples) s.cost += std::log(total) - lowest;
  out.samples = std::move(samples);
  return out;
}

}  // namespace liealign

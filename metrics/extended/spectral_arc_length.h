// Smoothness of each wrist's speed profile by its spectrum. Source: Balasubramanian, Melendez-Calderon,
// Roby-Brami, Burdet: On the analysis of movement smoothness, J. NeuroEng. Rehabil. 12:112, 2015 (SPARC).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <unsupported/Eigen/FFT>

#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Parameters from the paper: highest frequency considered (Hz), normalized magnitude below which the spectrum
// is cut off, and the zero padding as a power of two.
inline constexpr double kSparcMaxFrequency = 10;
inline constexpr double kSparcThreshold = 0.05;
inline constexpr int kSparcPadding = 4;

// Returns the negative arc length of the normalized magnitude spectrum (divided by its maximum) over
// frequency (divided by the width of its range). The range runs from the lowest to the highest frequency, up
// to kSparcMaxFrequency, at which the magnitude reaches kSparcThreshold. The profile is zero-padded to
// 2^(ceil(log2 M) + kSparcPadding) values. `speed` has one value every dt (s). Returns NaN for fewer than two
// values, without movement, or if the range has fewer than two frequencies.
inline double SpectralArcLength(std::span<const double> speed, double dt) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (speed.size() < 2 || std::all_of(speed.begin(), speed.end(), [](double v) { return v == 0; }))
    return kNone;
  const int exponent = static_cast<int>(std::ceil(std::log2(speed.size()))) + kSparcPadding;
  const size_t size = size_t{1} << exponent;
  std::vector<double> padded(speed.begin(), speed.end());
  padded.resize(size);
  std::vector<std::complex<double>> spectrum;
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  fft.fwd(spectrum, padded);

  std::vector<double> magnitude;
  for (const std::complex<double>& value : spectrum) magnitude.push_back(std::abs(value));
  const double largest = *std::max_element(magnitude.begin(), magnitude.end());
  const double step = 1 / (dt * static_cast<double>(size));  // Hz
  int first = -1, last = -1;
  for (int k = 0; k < static_cast<int>(magnitude.size()) && k * step <= kSparcMaxFrequency; ++k) {
    magnitude[k] /= largest;
    if (magnitude[k] < kSparcThreshold) continue;
    if (first < 0) first = k;
    last = k;
  }
  if (last <= first) return kNone;
  double length = 0;
  for (int k = first; k < last; ++k)
    length += std::hypot(1.0 / (last - first), magnitude[k + 1] - magnitude[k]);
  return -length;
}

// Spectral arc length of each wrist's speed norm(p_i - p_(i-1)) / dt. It needs the whole profile, so a value
// exists only at the end of the episode. If any sample is missing, including the first or the last, there is
// no value.
class WristSpectralArcLength : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"spectral_arc_length"};
  explicit WristSpectralArcLength(const MetricsConfig& config)
      : dt_(config.control_dt), speed_(config.arms.size()) {
    // Enough for five minutes at 50 Hz. Longer episodes require a reallocation.
    for (std::vector<double>& speed : speed_) speed.reserve(15000);
  }

  void Start() override {
    for (std::vector<double>& speed : speed_) speed.clear();
    samples_ = 0;
  }
  void Add(const DerivedSample& derived) override {
    if (samples_++ == 0) return;
    for (size_t k = 0; k < speed_.size(); ++k) speed_[k].push_back(derived.wrist_speed[k]);
  }
  void Values(std::span<double> values) const override { std::fill(values.begin(), values.end(), kNone); }
  void FinalValues(int64_t last_tick, std::span<double> values) const override {
    Values(values);
    if (samples_ != last_tick) return;
    for (size_t k = 0; k < speed_.size(); ++k) values[k] = SpectralArcLength(speed_[k], dt_);
  }

 private:
  double dt_;
  std::vector<std::vector<double>> speed_;
  int64_t samples_ = 0;
};

}  // namespace evalbus::metrics

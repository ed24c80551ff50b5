#include "report/episode_trace.h"

#include <cmath>
#include <limits>

#include "report/episode_tracks.h"

namespace evalbus::report {
namespace {

// Smaller changes, in SI units, are ignored. This limit is above the simulated jitter of resting objects.
constexpr double kChange = 1e-5;

bool Changes(const viz::EpisodeTrack& track, size_t row) {
  double first = std::numeric_limits<double>::quiet_NaN();
  for (int64_t tick = 0; tick < track.ticks(); ++tick) {
    const double value = track.Value(row, tick);
    if (!std::isfinite(value)) continue;
    if (std::isnan(first)) first = value;
    if (std::abs(value - first) > kChange) return true;
  }
  return false;
}

CurveFigure Figure(const viz::EpisodeTrack& track, const viz::Curve& curve) {
  CurveFigure figure{.name = curve.label, .unit = curve.unit, .time = {}, .lines = {}, .events = {}};
  for (const std::string& part : curve.parts) figure.lines.push_back({part, {}});
  // A single line has points only at its own samples. Several lines share their times, with NaN for missing
  // values.
  const bool is_single = figure.lines.size() == 1;
  for (int64_t tick = 0; tick < track.ticks(); ++tick) {
    if (!track.has_tick(tick)) continue;
    if (is_single && curve.is_sparse && std::isnan(track.Value(curve.first_row, tick))) continue;
    figure.time.push_back(track.Time(tick));
    for (size_t part = 0; part < figure.lines.size(); ++part) {
      figure.lines[part].value.push_back(track.Value(curve.first_row + part, tick) * curve.scale);
    }
  }
  return figure;
}

std::vector<EpisodeEvent> Events(const viz::EpisodeTrack& track) {
  using From = viz::TrackEvent::Kind;
  using Kind = EpisodeEvent::Kind;
  std::vector<EpisodeEvent> events;
  for (const viz::TrackEvent& event : track.Events()) {
    if (event.kind == From::kGrasp || event.kind == From::kRelease || event.kind == From::kCause ||
        event.kind == From::kNoReturn)
      continue;
    const Kind kind = event.kind == From::kStage  ? Kind::kStage
                      : event.kind == From::kSlip ? Kind::kSlip
                      : event.kind == From::kEnd  ? Kind::kEnd
                                                  : Kind::kCollision;
    events.push_back({kind, event.time, event.text});
  }
  return events;
}

}  // namespace

EpisodeTrace Trace(const viz::EpisodeTrack& track) {
  EpisodeTrace trace{.figures = {}, .events = Events(track)};
  for (const viz::Curve& curve : track.curves().curves()) {
    bool changes = false;
    for (size_t part = 0; part < curve.parts.size(); ++part) {
      changes = changes || Changes(track, curve.first_row + part);
    }
    if (!changes) continue;
    trace.figures.push_back(Figure(track, curve));
    trace.figures.back().events = trace.events;
  }
  return trace;
}

}  // namespace evalbus::report

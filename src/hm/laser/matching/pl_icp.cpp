#include "hm/laser/matching/pl_icp.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/laser/matching/icp_covariance.hpp"
#include "hm/laser/matching/icp_pairs.hpp"
#include "hm/laser/matching/reference_lines.hpp"

namespace hm {
namespace {

constexpr std::size_t kMinCoarsePoints = 120;  // no coarse iterations below this
constexpr double kCoarseStep_m = 5e-3;         // a coarse step shorter than this ends the coarse part
constexpr double kWeakInformation = 0.02;      // share of the pairs that may only correct a good guess ...
constexpr double kWeakReach_m = 0.05;          // ... by so much
constexpr double kMostDeviations = 2.5;        // of the guess by which a weakly held direction may correct it
constexpr double kWeakMargin = 1.5;            // on the share of the pairs that did so all the same
constexpr double kTrimShrink = 0.25;           // an iteration's least trimming limit to the last one's
constexpr double kMaxCarryShift = 5;           // standard deviations that a point is moved at most
constexpr double kPoorError = 1.5;   // mean error of a suspicious result, in standard deviations of a range
constexpr double kFarFromGuess = 4;  // correction of a suspicious result, in the same unit
constexpr double kNearError = 3;     // error of a pair that supports a result, in the same unit
constexpr double kNarrowTrim = 6;    // least trimming limit of a start from a good guess

}  // namespace

/// Quality of the guess: it may be off by as much as points are paired, or only by little.
enum class Start { kWide, kNarrow };

struct PlIcp::State {
  explicit State(const PlIcpParams& given) : params(given) {}

  PlIcpParams params;
  // Reference.
  ReferenceLines reference, spare;
  Vec2 reference_origin_m = Vec2::Zero();
  double reference_sigma_m = 0.01;
  std::vector<float> offset_sum, offset_count;  // offsets of later scans from each line since the last fit
  int pending_scans = 0, improved_scans = 0;
  // The last match.
  ScanPoints sensed;
  Vec2 sensed_origin_m = Vec2::Zero();
  IcpPairs pairs;
  IcpCovariance covariance;
  SE2 X, X_guess;  // sensed to reference points, each relative to its own origin
  FreeDirections free;
  PointToLineSums sums;
  IcpPairs other_pairs;  // of the result that was not kept
  bool matched = false;
  double range_sigma_m = 0.01;
  double least_information = 0;  ///< share of the pairs that constrains a direction, in this run
  std::vector<float> scratch;
  std::vector<std::uint64_t> seen;  // fingerprints of the match's pairs

  [[nodiscard]] double sigma_of(const ScanPoints& points) {
    return params.range_sigma_m > 0 ? params.range_sigma_m : estimate_range_sigma(points, scratch);
  }
  void fit_reference();
  [[nodiscard]] double trimming_floor_m(Start start, int iteration) const;
  [[nodiscard]] FreeDirections free_directions(double information_ratio) const;
  [[nodiscard]] bool iterate(Start start, std::size_t stride, ScanMatch& match, Vec3& step);
  void run(Start start, ScanMatch& match);
  [[nodiscard]] Vec3 moved() const;
  [[nodiscard]] bool moved_along_weak_direction() const;
  [[nodiscard]] FreeDirections weakly_held() const;
  [[nodiscard]] double information_against(const Mat3& guess_covariance) const;
  void rerun(double information_ratio, ScanMatch& match);
  [[nodiscard]] bool is_suspicious(const ScanMatch& match) const;
  [[nodiscard]] std::size_t support() const;
  void try_narrow(ScanMatch& match);
  void judge(const SE2& guess, ScanMatch& match);
  void add_covariance(ScanMatch& match);
  void apply_pending(int max_scans);
  void carry_over(ReferenceLines& next, int max_scans) const;
};

void PlIcp::State::fit_reference() {
  reference.fit({params.line_half_length_m, reference_sigma_m});
  offset_sum.assign(reference.size(), 0);
  offset_count.assign(reference.size(), 0);
  pending_scans = 0;
}

/// Pairs with smaller errors are not trimmed: while the guess may be far off, those few that constrain a
/// direction have large ones.
double PlIcp::State::trimming_floor_m(Start start, int iteration) const {
  if (!(params.line_half_length_m > 0)) return 0;  // as published
  const double first_m =
      start == Start::kWide ? params.kMaxCorrespondenceDistance_m : kNarrowTrim * range_sigma_m;
  return first_m * std::pow(kTrimShrink, iteration);
}

/// Directions that less than this share of the pairs constrains, or no more of them than noise would.
FreeDirections PlIcp::State::free_directions(double information_ratio) const {
  const FreeDirections uncertain = weakly_held();
  if (uncertain.count == 0) return uncertain;
  const Mat3 of_noise = pairs.noise_information(reference, sensed, params.weight_by_incidence);
  return find_free_directions(sums, of_noise, {information_ratio, params.information_over_noise});
}

/// One iteration: pairs, trims, solves. False when there are too few pairs or no constrained direction; the
/// match has the status.
bool PlIcp::State::iterate(Start start, std::size_t stride, ScanMatch& match, Vec3& step) {
  pairs.find(reference, sensed, X, stride, params);
  match.pairs = pairs.trim(params, range_sigma_m, trimming_floor_m(start, match.iterations));
  ++match.iterations;
  const double smaller =
      static_cast<double>(std::min(sensed.size(), reference.size())) / static_cast<double>(stride);
  const double needed = std::max(static_cast<double>(params.kMinPairs) / static_cast<double>(stride),
                                 params.min_pairs_ratio * smaller);
  if (static_cast<double>(match.pairs) < std::max(3.0, needed)) {
    match.status = MatchStatus::kTooFewPairs;
    return false;
  }
  sums = pairs.sums(reference, sensed, params.weight_by_incidence);
  free = free_directions(least_information);
  if (free.count == 3) {
    match.status = MatchStatus::kNoInformation;
    return false;
  }
  if (free.count == 0) {
    step = exact_step(sums);
  } else {
    const Vec2 shift = X.translation() - X_guess.translation();
    step = step_without(free, sums, {shift.x(), shift.y(), wrap_angle(X.angle() - X_guess.angle())});
  }
  X = SE2(X.translation() + step.head<2>(), X.angle() + step.z());
  return true;
}

void PlIcp::State::run(Start start, ScanMatch& match) {
  X = X_guess;
  const auto coarse = static_cast<std::size_t>(std::max(1, params.coarse_stride));
  std::size_t stride = sensed.size() / coarse >= kMinCoarsePoints ? coarse : 1;
  seen.clear();
  match.status = MatchStatus::kMatched;
  while (match.iterations < params.max_iterations) {
    if (match.iterations + 1 == params.max_iterations) stride = 1;
    Vec3 step;
    if (!iterate(start, stride, match, step)) return;
    const double shift = step.head<2>().norm(), turn = std::abs(step.z());
    if (stride > 1) {
      if (shift + turn * sums.arm_m() < kCoarseStep_m) stride = 1;
      continue;
    }
    if (shift < params.epsilon_xy_m && turn < params.epsilon_angle_rad) {
      match.end = MatchEnd::kSmallStep;
      return;
    }
    const std::uint64_t fingerprint = pairs.fingerprint();
    if (std::find(seen.begin(), seen.end(), fingerprint) != seen.end()) {
      match.end = MatchEnd::kSamePairs;
      return;
    }
    seen.push_back(fingerprint);
  }
}

/// Motion from the guess, with the turn times the pairs' mean range.
Vec3 PlIcp::State::moved() const {
  const Vec2 shift = X.translation() - X_guess.translation();
  return {shift.x(), shift.y(), wrap_angle(X.angle() - X_guess.angle()) * sums.arm_m()};
}

/// True when few pairs alone moved the result far from the guess. Few pairs may hold a direction (the reveals
/// of doors along a hallway), but after a strong tilt those few lie on floor or ceiling: the guess is better.
bool PlIcp::State::moved_along_weak_direction() const {
  const FreeDirections weak = free_directions(kWeakInformation);
  for (int k = 0; k < weak.count; ++k)
    if (std::abs(weak.directions[static_cast<std::size_t>(k)].dot(moved())) > kWeakReach_m) return true;
  return false;
}

FreeDirections PlIcp::State::weakly_held() const {
  return find_free_directions(sums, Mat3::Zero(), {kFirmShare, 0});
}

/// The least share of the pairs that constrains a direction, so that no direction that few pairs hold leads
/// further from the guess than its covariance allows. 0 where none does.
double PlIcp::State::information_against(const Mat3& guess_covariance) const {
  const FreeDirections weak = weakly_held();
  const Vec3 scale(1, 1, weak.arm_m), unscale = scale.cwiseInverse();
  double least = 0;
  for (int k = 0; k < weak.count; ++k) {
    const Vec3& direction = weak.directions[static_cast<std::size_t>(k)];
    const Vec3 scaled = scale.asDiagonal() * direction, unscaled = unscale.asDiagonal() * direction;
    const double variance = scaled.dot(guess_covariance * scaled) + range_sigma_m * range_sigma_m;
    const double shift_m = direction.dot(moved());
    if (shift_m * shift_m <= kMostDeviations * kMostDeviations * variance) continue;
    const double information = unscaled.dot(sums.information() * unscaled) / sums.weight;
    least = std::max(least, std::min(kFirmShare, kWeakMargin * information));
  }
  return least;
}

/// From the guess again, with directions held by fewer pairs left free.
void PlIcp::State::rerun(double information_ratio, ScanMatch& match) {
  least_information = information_ratio;
  match.iterations = 0;
  run(Start::kWide, match);
}

/// True when the pairs do not fit within the noise, or the points moved far from the guess: a minimum that
/// wrong pairs hold up looks like this, but a cluttered place or a bad guess too.
bool PlIcp::State::is_suspicious(const ScanMatch& match) const {
  if (match.status != MatchStatus::kMatched || pairs.mean_error_m() > kPoorError * range_sigma_m) return true;
  const double turn = std::abs(wrap_angle(X.angle() - X_guess.angle()));
  const double moved_m = (X.translation() - X_guess.translation()).norm() + turn * sums.arm_m();
  return moved_m > kFarFromGuess * range_sigma_m;
}

/// Number of pairs that fit within the noise.
std::size_t PlIcp::State::support() const { return pairs.count_within(kNearError * range_sigma_m); }

/// Iterates once more from the guess, without the pairs that are far off there, and keeps the result with
/// more support.
void PlIcp::State::try_narrow(ScanMatch& match) {
  const SE2 first_X = X;
  const FreeDirections first_free = free;
  const PointToLineSums first_sums = sums;
  const std::size_t first_support = match.status == MatchStatus::kMatched ? support() : 0;
  std::swap(pairs, other_pairs);
  pairs.begin(sensed.size(), reference.size());
  ScanMatch other = match;
  other.iterations = 0;
  run(Start::kNarrow, other);
  if (other.status == MatchStatus::kMatched && support() > first_support) {
    match = other;
    return;
  }
  std::swap(pairs, other_pairs);
  X = first_X, free = first_free, sums = first_sums;
}

void PlIcp::State::judge(const SE2& guess, ScanMatch& match) {
  // Back from the scans' origins to their frames.
  const SE2 found = SE2(reference_origin_m, 0) * X * SE2(-sensed_origin_m, 0);
  const double turn = std::abs(wrap_angle(found.angle() - guess.angle()));
  if ((found.translation() - guess.translation()).norm() > params.max_linear_correction_m ||
      turn > params.kMaxAngularCorrection_rad) {
    match.status = MatchStatus::kCorrectionTooLarge;
    return;
  }
  match.T_reference_sensed = found;
  match.mean_error_m = pairs.mean_error_m();
  match.free = free;
  match.weak = weakly_held();
  match.free.at_m = match.weak.at_m = X.translation() + reference_origin_m;
  if (params.compute_covariance) add_covariance(match);
}

void PlIcp::State::add_covariance(ScanMatch& match) {
  Mat3 covariance_at_origin = covariance.compute(
      reference, sensed, pairs,
      {inverse_information(free, sums.information()), range_sigma_m, params.weight_by_incidence});
  const Vec3 scale(1, 1, 1 / free.arm_m);
  for (int k = 0; k < free.count; ++k) {
    const Vec3 direction = scale.asDiagonal() * free.directions[static_cast<std::size_t>(k)];
    covariance_at_origin += kFreeDirectionVariance_m2 * direction * direction.transpose();
  }
  // From the sensed scan's origin to the origin of its frame: t = t_X + o_r - R o_s.
  Mat3 jacobian = Mat3::Identity();
  const Vec2 lever = X.rotation() * sensed_origin_m;
  jacobian(0, 2) = lever.y();
  jacobian(1, 2) = -lever.x();
  match.covariance = jacobian * covariance_at_origin * jacobian.transpose();
}

PlIcp::PlIcp(const PlIcpParams& params) : state_(std::make_unique<State>(params)) {}
PlIcp::~PlIcp() = default;
PlIcp::PlIcp(PlIcp&&) noexcept = default;
PlIcp& PlIcp::operator=(PlIcp&&) noexcept = default;

const PlIcpParams& PlIcp::params() const { return state_->params; }

void PlIcp::set_reference(const PlanarScan& reference) {
  State& s = *state_;
  s.reference.points.assign(reference);
  s.reference.scans.assign(s.reference.size(), 1.0F);
  s.reference_origin_m = reference.origin_m;
  s.reference_sigma_m = s.sigma_of(s.reference.points);
  s.improved_scans = 0;
  s.matched = false;
  s.fit_reference();
}

ScanMatch PlIcp::match(const PlanarScan& reference, const PlanarScan& sensed,
                       const SE2& T_reference_sensed_guess) {
  set_reference(reference);
  return match(sensed, T_reference_sensed_guess);
}

ScanMatch PlIcp::match(const PlanarScan& sensed, const SE2& T_reference_sensed_guess,
                       const std::optional<Mat3>& guess_covariance, double least_share) {
  State& s = *state_;
  ScanMatch match;
  s.matched = false;
  s.sensed.assign(sensed);
  s.sensed_origin_m = sensed.origin_m;
  match.sensed_points = s.sensed.size();
  const auto needed = static_cast<std::size_t>(s.params.kMinPairs);
  if (s.sensed.size() < needed || s.reference.size() < needed) return match;
  if (!T_reference_sensed_guess.vector().allFinite()) {
    match.status = MatchStatus::kInvalidGuess;
    return match;
  }
  match.range_sigma_m = s.range_sigma_m = s.sigma_of(s.sensed);
  s.pairs.begin(s.sensed.size(), s.reference.size());
  s.X_guess = SE2(-s.reference_origin_m, 0) * T_reference_sensed_guess * SE2(s.sensed_origin_m, 0);
  s.least_information = std::max(s.params.min_information_ratio, least_share);
  s.run(Start::kWide, match);
  if (s.least_information > 0 && s.least_information < kWeakInformation && s.moved_along_weak_direction())
    s.rerun(kWeakInformation, match);
  if (s.params.line_half_length_m > 0 && s.is_suspicious(match)) s.try_narrow(match);
  if (guess_covariance && match.status == MatchStatus::kMatched)
    if (const double against = s.information_against(*guess_covariance); against > s.least_information)
      s.rerun(against, match);
  if (match.status == MatchStatus::kMatched) s.judge(T_reference_sensed_guess, match);
  s.matched = match.ok();
  return match;
}

/// Moves the reference's points to the mean of their observations and refits the lines.
void PlIcp::State::apply_pending(int max_scans) {
  if (pending_scans == 0) return;
  for (std::size_t j = 0; j < reference.size(); ++j) {
    if (offset_count[j] == 0) continue;
    const float scans = reference.scans[j], total = scans + offset_count[j];
    const float own =
        reference.nx[j] * reference.points.x[j] + reference.ny[j] * reference.points.y[j] - reference.d[j];
    reference.shift_point(j, (scans * own + offset_sum[j]) / total - own);
    reference.scans[j] = std::min(static_cast<float>(max_scans), total);
  }
  fit_reference();
}

void PlIcp::improve_reference(int max_scans) {
  State& s = *state_;
  if (!s.matched || !(s.params.line_half_length_m > 0)) return;
  for (const IcpPairs::Pair& pair : s.pairs.pairs()) {
    if (!s.reference.smooth[pair.line] || s.reference.scans[pair.line] >= static_cast<float>(max_scans))
      continue;
    s.offset_sum[pair.line] -= pair.error;
    s.offset_count[pair.line] += 1;
  }
  ++s.improved_scans;
  // Refits become less frequent as the mean converges.
  if (++s.pending_scans > s.improved_scans / 4) s.apply_pending(max_scans);
  s.matched = false;  // the pairs refer to the old lines
}

/// Moves the points of the last scan towards their paired lines, weighted by the scans averaged in these
/// lines.
void PlIcp::State::carry_over(ReferenceLines& next, int max_scans) const {
  for (const IcpPairs::Pair& pair : pairs.pairs()) {
    if (!reference.smooth[pair.line]) continue;
    const float nx = reference.nx[pair.line], ny = reference.ny[pair.line],
                scans = reference.scans[pair.line];
    const float cosine = (nx * pair.qx + ny * pair.qy) / sensed.range[pair.point];
    if (std::abs(cosine) < 0.05F) continue;
    const float along = pair.error * scans / (scans + 1) / cosine;
    const float range = sensed.range[pair.point] + along;
    if (!(range > 0) || std::abs(along) > static_cast<float>(kMaxCarryShift * range_sigma_m)) continue;
    const float factor = range / sensed.range[pair.point];
    next.points.x[pair.point] *= factor;
    next.points.y[pair.point] *= factor;
    next.points.range[pair.point] = range;
    next.scans[pair.point] = std::min(static_cast<float>(max_scans), scans + 1);
  }
}

void PlIcp::advance_reference(int max_scans) {
  State& s = *state_;
  ReferenceLines& next = s.spare;
  next.points = s.sensed;
  next.scans.assign(next.size(), 1.0F);
  if (s.matched && max_scans > 1 && s.params.line_half_length_m > 0) s.carry_over(next, max_scans);
  std::swap(s.reference, next);
  s.reference_origin_m = s.sensed_origin_m;
  s.reference_sigma_m = s.sigma_of(s.sensed);
  s.improved_scans = 0;
  s.matched = false;
  s.fit_reference();
}

std::string_view to_string(MatchStatus status) {
  switch (status) {
    case MatchStatus::kMatched:
      return "matched";
    case MatchStatus::kTooFewPoints:
      return "too few points";
    case MatchStatus::kTooFewPairs:
      return "too few pairs";
    case MatchStatus::kNoInformation:
      return "no information";
    case MatchStatus::kCorrectionTooLarge:
      return "correction too large";
    case MatchStatus::kInvalidGuess:
      return "invalid guess";
  }
  return "";
}

std::string FreeDirections::to_string() const {
  if (count == 0) return "none";
  std::string text;
  for (int k = 0; k < count; ++k) {
    const Vec3& direction = directions[static_cast<std::size_t>(k)];
    if (k > 0) text += ", ";
    if (std::abs(direction.z()) < 0.2) {
      double degrees = std::atan2(direction.y(), direction.x()) * 180 / std::numbers::pi;
      degrees = std::fmod(degrees + 360.0, 180.0);  // either way along a line
      text += fmt::format("along {:.0f} deg", degrees);
    } else {
      const double turn = direction.z() / arm_m;
      text += fmt::format("around ({:.2f}, {:.2f}) m", at_m.x() - direction.y() / turn,
                          at_m.y() + direction.x() / turn);
    }
  }
  return text;
}

}  // namespace hm

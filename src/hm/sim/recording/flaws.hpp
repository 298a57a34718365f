#pragma once
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/sim/sensor/depth_sensor.hpp"

namespace hm {

/// Flaws of a real recording that an ideal one lacks, beyond the noise of its depth sensor (SensorEffects).
enum class Flaw : unsigned {
  kBlur,            ///< colour moves while it is exposed
  kRollingShutter,  ///< rows of the colour image are exposed one after another
  kExposure,        ///< automatic exposure and white balance, which follow the scene with a delay
  kIntrinsics,      ///< the camera is not as the recording says
  kRegistration,    ///< the colour image is shifted against depth
  kDepthBend,       ///< depth is wrong by an amount that grows with distance and varies over the image
  kTimeOffset,      ///< colour is exposed after depth, though both have the same stamp
  kWheelSlip,       ///< reported poses are those of wheels (WheelErrors)
  kGlass,           ///< panes reflect, and are measured through where they are seen frontally
  kPeople,          ///< people walk ahead of the camera
  // What a recording has that nobody registered or calibrated, and what the others do not need: not among
  // "all".
  kUnregistered,  ///< colour is that of a camera beside the depth camera, with a wider view
  kShortDepth,    ///< near surfaces read too short
  kDepthGrain,    ///< neighbouring depth readings err alike
};
inline constexpr std::string_view kFlawNames[] = {
    "blur",       "rolling_shutter", "exposure", "intrinsics",   "registration", "depth_bend", "time_offset",
    "wheel_slip", "glass",           "people",   "unregistered", "short_depth",  "depth_grain"};
/// How many of them "all" names: what a recording has whose cameras are calibrated.
inline constexpr std::size_t kRealisticFlaws = static_cast<std::size_t>(Flaw::kUnregistered);

/// Set of flaws.
class Flaws {
 public:
  /// Reads names separated by commas; "all" is the first kRealisticFlaws, "" none. Error (kUsage): an unknown
  /// name, with the known ones.
  static Result<Flaws> parse(std::string_view names);
  [[nodiscard]] bool has(Flaw flaw) const { return (bits_ >> static_cast<unsigned>(flaw) & 1U) != 0; }
  [[nodiscard]] bool is_empty() const { return bits_ == 0; }

 private:
  unsigned bits_ = 0;
};

/// Sizes of the flaws of one recording, and the ranges that they come from. Zero: it has no such flaw.
struct FlawSizes {
  Flaws flaws;
  double exposure_s = 0;
  double readout_s = 0;  ///< from the first row to the last; the middle row is exposed at colour's time
  double exposure_lag_s = 0, white_balance_ratio = 0;
  double focal_x_ratio = 0, focal_y_ratio = 0, center_x_ratio = 0, center_y_ratio = 0;
  double color_shift_x_px = 0, color_shift_y_px = 0, color_baseline_m = 0;
  double color_focal_ratio = 0, color_beside_m = 0;
  double bend_at_3m_m = 0;
  double short_at_1m_ratio = 0;
  double color_delay_s = 0;
  double glass_angle_rad = 0;
  int people = 0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    if (self.flaws.has(Flaw::kBlur))
      v(ParamDoc{"exposure_s", {0.008, 0.02}, "exposure time of a colour image"}, self.exposure_s);
    if (self.flaws.has(Flaw::kRollingShutter))
      v(ParamDoc{"readout_s", {0.015, 0.03}, "from the first row of a colour image to the last"},
        self.readout_s);
    if (self.flaws.has(Flaw::kExposure)) visit_exposure(self, v);
    if (self.flaws.has(Flaw::kIntrinsics)) visit_intrinsics(self, v);
    if (self.flaws.has(Flaw::kRegistration)) visit_registration(self, v);
    if (self.flaws.has(Flaw::kDepthBend))
      v(ParamDoc{"bend_at_3m_m", {-0.03, 0.03}, "depth error at 3 m in the corners; minus it in the middle"},
        self.bend_at_3m_m);
    if (self.flaws.has(Flaw::kUnregistered)) visit_unregistered(self, v);
    if (self.flaws.has(Flaw::kShortDepth))
      v(ParamDoc{"short_at_1m_ratio", {0.04, 0.04}, "depth at 1 m is too short by this share, at 3 m right"},
        self.short_at_1m_ratio);
    if (self.flaws.has(Flaw::kTimeOffset))
      v(ParamDoc{"color_delay_s", {0.005, 0.02}, "from depth to the middle row of colour"},
        self.color_delay_s);
    if (self.flaws.has(Flaw::kGlass))
      v(ParamDoc{"glass_angle_rad", {0.3, 0.6}, "panes are measured through up to this angle of incidence"},
        self.glass_angle_rad);
    if (self.flaws.has(Flaw::kPeople))
      v(ParamDoc{"people", {1, 3}, "people who walk ahead of the camera"}, self.people);
  }

 private:
  template <class Self, class Visitor>
  static void visit_exposure(Self& self, Visitor& v) {
    v(ParamDoc{"exposure_lag_s", {0.2, 0.6}, "time constant of automatic exposure and white balance"},
      self.exposure_lag_s);
    v(ParamDoc{"white_balance_ratio", {0.2, 0.5}, "share of a mean colour that white balance removes"},
      self.white_balance_ratio);
  }
  template <class Self, class Visitor>
  static void visit_intrinsics(Self& self, Visitor& v) {
    v(ParamDoc{"focal_x_ratio", {-0.005, 0.005}, "true fx over the stated one, minus 1"}, self.focal_x_ratio);
    v(ParamDoc{"focal_y_ratio", {-0.005, 0.005}, "true fy over the stated one, minus 1"}, self.focal_y_ratio);
    v(ParamDoc{"center_x_ratio", {-0.005, 0.005}, "true cx minus the stated one, as a share of the width"},
      self.center_x_ratio);
    v(ParamDoc{"center_y_ratio", {-0.005, 0.005}, "true cy minus the stated one, as a share of the width"},
      self.center_y_ratio);
  }
  template <class Self, class Visitor>
  static void visit_registration(Self& self, Visitor& v) {
    v(ParamDoc{"color_shift_x_px", {-3, 3}, "colour is seen so much to the right of depth"},
      self.color_shift_x_px);
    v(ParamDoc{"color_shift_y_px", {-3, 3}, "colour is seen so much below depth"}, self.color_shift_y_px);
    v(ParamDoc{"color_baseline_m", {-0.004, 0.004}, "colour camera to the right of where it is registered"},
      self.color_baseline_m);
  }
  template <class Self, class Visitor>
  static void visit_unregistered(Self& self, Visitor& v) {
    v(ParamDoc{"color_focal_ratio", {-0.1, -0.1}, "colour's focal length over that of depth, minus 1"},
      self.color_focal_ratio);
    v(ParamDoc{"color_beside_m", {0.03, 0.03}, "colour camera to the right of the depth camera"},
      self.color_beside_m);
  }
};

/// Draws the sizes of these flaws. A size depends only on the seed, not on the other flaws.
FlawSizes draw_flaws(const Flaws& flaws, std::uint64_t seed);

/// Camera that takes the images of a recording whose stated camera is `stated`.
PinholeCamera true_camera(const PinholeCamera& stated, const FlawSizes& sizes);

}  // namespace hm

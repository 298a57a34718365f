#pragma once
#include <array>
#include <deque>
#include <utility>

#include "hm/control/cascade.hpp"

namespace hm {

/// A quadrotor for the tests of the controllers, in double precision: rigid body, rotors with lag, linear
/// drag. Independent of the room's own mathematics.
struct QuadrotorBodySettings {
  double mass_kg = 1.387;
  double spin_up_s = 0.0125, spin_down_s = 0.025;
  double drag_per_s = 0.136;
  double thrust_factor = 1;                        ///< of all rotors (battery)
  std::array<double, 4> rotor_factor{1, 1, 1, 1};  ///< of each
  int delay_steps = 0;                             ///< of position and velocity as the controller sees them
  /// Inner loop for attitude commands: none (rotors), second order (12 rad/s, damping 0.8), or first order
  /// (0.257 s, gain 0.75: the Firefly that ETH identified).
  enum class InnerLoop { kRotors, kSecondOrder, kFirstOrder } inner = InnerLoop::kRotors;
};

class QuadrotorBody {
 public:
  explicit QuadrotorBody(const QuadrotorBodySettings& settings = {});
  /// At rest in the air, rotors at the speed that carries the vehicle.
  void hover_at(const Eigen::Vector3d& position_m);
  /// Advances 1 ms.
  void step(const CascadeOutput& output);
  /// Input of the controller: position and velocity late, the rest now.
  [[nodiscard]] ControlState seen() const;

  Eigen::Vector3d position = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d rates = Eigen::Vector3d::Zero();
  Eigen::Vector3d push_m_s2 = Eigen::Vector3d::Zero();  ///< acceleration by a disturbance
  std::array<double, 4> speed{};
  [[nodiscard]] double roll() const;
  [[nodiscard]] double pitch() const;
  [[nodiscard]] double yaw() const;
  [[nodiscard]] double tilt() const;

 private:
  void turn_by_rotors(const std::array<float, 4>& wanted, Eigen::Vector3d& force);
  void turn_by_inner_loop(const RpytCommand& command, Eigen::Vector3d& force);
  void remember();

  QuadrotorBodySettings settings_;
  Eigen::Vector3d felt_{0, 0, 9.80665};
  std::array<double, 3> angle_{}, angle_rate_{};  // of the inner loop: roll, pitch, yaw
  double thrust_n_ = 0;
  std::deque<std::pair<Eigen::Vector3d, Eigen::Vector3d>> seen_;
};

}  // namespace hm

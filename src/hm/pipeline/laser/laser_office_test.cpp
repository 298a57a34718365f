#include <gtest/gtest.h>

#include "hm/pipeline/laser/laser_pipeline.hpp"
#include "hm/sim/office/office_simulation.hpp"

namespace hm {
namespace {

/// Once wheel odometry has replaced a match, good matches after it are not refused: 17 poses of this drive
/// were those of the wheels when they were judged by what was scanned before, and 4 since.
TEST(LaserOffice, AReplacedMatchLetsTheNextOnesPass) {
  OfficeSimulationOptions options;
  options.seed = 2;
  const OfficeSimulation office(options);
  LaserPipeline pipeline({}, {{LaserRig{}}, false, true});
  for (std::size_t i = 0; i < office.scan_count(); ++i) {
    pipeline.add_odometry(office.odometry()[i]);
    pipeline.add_scan(office.scan(i));
  }
  pipeline.finish();
  std::size_t posed = 0, unconfirmed = 0;
  for (const LaserStep& step : pipeline.take_steps()) {
    posed += step.T_odom_base.has_value();
    unconfirmed += !step.odometry.confirmed;
  }
  EXPECT_EQ(posed, office.scan_count());
  EXPECT_GE(unconfirmed, 1U);
  EXPECT_LE(unconfirmed, 8U);
}

}  // namespace
}  // namespace hm

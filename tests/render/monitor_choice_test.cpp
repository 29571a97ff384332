#include "render/gl/monitor_choice.hpp"

#include <gtest/gtest.h>

namespace afterglow::render::monitor_choice_test {
namespace {

const Monitor kOperator{"eDP-1", "", 0, 0, 1920, 1080};
const Monitor kProjector{"HDMI-1", "PA503W", 1920, 0, 1280, 800};

MonitorChoice choose(const std::vector<Monitor>& monitors, const std::string& wanted) {
  return chooseMonitor(monitors, wanted, 1280, 800);
}

TEST(MonitorChoice, knowsAMonitorByConnectorModelAndIndex) {
  for (const char* name : {"HDMI-1", "PA503W", "1", ""}) {
    const MonitorChoice choice = choose({kOperator, kProjector}, name);
    EXPECT_EQ(choice.monitor, 1u) << name;
    EXPECT_EQ(choice.problem, "");
  }
  EXPECT_EQ(choose({kProjector}, "").monitor, 0u);  // a robot's only screen
}

TEST(MonitorChoice, takesNoOtherMonitorForTheOneThatIsGone) {
  const Monitor same_size{"eDP-1", "", 0, 0, 1280, 800};
  EXPECT_FALSE(choose({same_size}, "HDMI-1").monitor);
  EXPECT_EQ(choose({kOperator}, "HDMI-1").problem,
            "no monitor 'HDMI-1'; there are: 0 'eDP-1' 1920x1080");
  EXPECT_EQ(choose({}, "").problem, "no monitor ''; there are: none");
}

TEST(MonitorChoice, refusesAnotherResolution) {
  Monitor wrong = kProjector;
  wrong.width = 1920;
  EXPECT_FALSE(choose({kOperator, wrong}, "HDMI-1").monitor);
  EXPECT_EQ(choose({kOperator, wrong}, "HDMI-1").problem,
            "monitor 'HDMI-1' is set to 1920x800 but the projector's lens is for 1280x800: set "
            "the output to that resolution");
}

TEST(MonitorChoice, refusesAMonitorThatIsMirroredOnAnother) {
  Monitor mirrored = kProjector;
  mirrored.x = 100;
  EXPECT_EQ(
      choose({kOperator, mirrored}, "HDMI-1").problem,
      "monitor 'HDMI-1' shows what 'eDP-1' shows: extend the desktop instead of mirroring it");
}

TEST(MonitorChoice, asksWhichOfTwoOfOneModel) {
  Monitor second = kProjector;
  second.name = "HDMI-2";
  second.x += 1280;
  const std::vector<Monitor> all = {kOperator, kProjector, second};
  EXPECT_EQ(choose(all, "PA503W").problem.substr(0, 24), "several monitors 'PA503W");
  EXPECT_EQ(choose(all, "HDMI-2").monitor, 2u);
}

TEST(EdidModel, readsTheNameDescriptor) {
  std::vector<std::uint8_t> edid(128, 0);
  EXPECT_EQ(edidModel(edid), "");
  const std::vector<std::uint8_t> descriptor = {0,   0,   0,   0xfc, 0,   'P', 'A', '5', '0',
                                                '3', 'W', 0xa, ' ',  ' ', ' ', ' ', ' ', ' '};
  std::copy(descriptor.begin(), descriptor.end(), edid.begin() + 90);
  EXPECT_EQ(edidModel(edid), "PA503W");
  EXPECT_EQ(edidModel({edid.begin(), edid.begin() + 100}), "");
  EXPECT_EQ(edidModel({}), "");
}

}  // namespace
}  // namespace afterglow::render::monitor_choice_test

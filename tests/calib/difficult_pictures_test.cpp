// Ten difficult pairs of photographs in difficult/, each with another fault: a camera with an
// S-curve, a projector of another gamma that shines black, defocus, vignetting, mosaic and JPEG,
// a highlight, a color wheel's bands, a moving hand, a shadow, a window. In all of them the board
// sags by 1 mm, and the camera_info is 0.2 % and a pixel off. Made by
//   tests/referee/faulty_room.py photographs --seed 5 --views 10
//     --faults curve,sag,camera_info/gamma,sag/defocus,sag/vignetting,sag/jpeg,sag/highlight,sag/
//              bands,sag/motion,sag/shadow,sag/window,sag
// and kept as WebP of quality 85.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "calib/camera_info_file.hpp"
#include "calib/solver/solve.hpp"
#include "tests/support/referee_truth.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::calib::difficult_pictures_test {
namespace {

const std::string kFolder = "tests/calib/difficult/";

test::SyntheticRig trueRig() {
  const YAML::Node truth = YAML::LoadFile(kFolder + "truth.yaml");
  test::SyntheticRig rig = test::makeRig(test::RigKind::Standard, 1);  // board and pattern
  rig.camera = test::readTrueLens(truth["camera"]);
  rig.projector = test::readTrueLens(truth["projector"]);
  rig.T_world_camera = Rigid<World, Camera>(test::readTruePose(truth["T_world_camera"]));
  rig.T_world_projector = Rigid<World, Projector>(test::readTruePose(truth["T_world_projector"]));
  return rig;
}

TEST(DifficultPictures, calibrateAsWellAsTheCalibrationSaysOfItself) {
  const test::SyntheticRig rig = trueRig();
  std::vector<Photographs> photographs;
  for (int i = 0; i < 10; ++i) {
    const std::string name = test::viewName(i);
    photographs.push_back({name, loadPicture(kFolder + name + ".webp"),
                           loadPicture(kFolder + name + "_plain.webp")});
  }
  const Lens camera = loadCameraInfo(kFolder + "camera.yaml").lens;
  const Calibration result = solvePhotographs(photographs, rig.board, rig.pattern, camera);
  for (const ViewResult& view : result.views) EXPECT_TRUE(view.is_used) << view.reason;
  const double light_mm = test::errorP95_mm(rig, result.estimate);  // 1 to 2 m away
  EXPECT_LT(light_mm, 0.4);
  ASSERT_EQ(result.light.size(), 3u);
  EXPECT_LT(light_mm, result.light[1].mm);
  EXPECT_LT(result.light[1].mm, 1);  // at 2 m
  EXPECT_NEAR(result.board_shape.bends().x(), 1e-3, 1e-4);
  EXPECT_EQ(result.camera_change.fate, CameraFate::Refined);
  EXPECT_NEAR(result.camera_change.focal, rig.camera.K(0, 0) / camera.K(0, 0) - 1, 2e-4);
}

}  // namespace
}  // namespace afterglow::calib::difficult_pictures_test

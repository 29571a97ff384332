#include "calib/camera_info_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "calib/yaml_source.hpp"
#include "tests/support/projector_info.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::calib::camera_info_file_test {
namespace {

constexpr const char* kParsersForm = R"(
image_width: 1280
image_height: 800
camera_name: beamer
camera_matrix: {rows: 3, cols: 3, data: [1900, 0, 640, 0, 1901, 817, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.1, 0.02, 0.001, -0.002, 0.003]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [1900, 0, 640, 0, 0, 1901, 817, 0, 0, 0, 1, 0]}
)";

class CameraInfoFileTest : public ::testing::Test {
 protected:
  CameraInfoFile load(const std::string& text) {
    std::ofstream(path_) << text;
    return loadCameraInfo(path_);
  }
  std::string refusal(const std::string& text) {
    try {
      load(text);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "accepted";
  }
  static std::string with(const std::string& from, const std::string& to) {
    std::string text = kParsersForm;
    return text.replace(text.find(from), from.size(), to);
  }
  void expectRefusal(const std::string& text, const std::vector<std::string>& parts) {
    const std::string said = refusal(text);
    EXPECT_EQ(said.rfind(path_ + ": ", 0), 0u) << said;
    for (const std::string& part : parts) {
      EXPECT_NE(said.find(part), std::string::npos) << "\"" << part << "\" in: " << said;
    }
  }

  test::TempFolder folder_;
  const std::string path_ = folder_.path("projector.yaml");
};

TEST_F(CameraInfoFileTest, readsTheParsersForm) {
  const CameraInfoFile file = load(kParsersForm);
  EXPECT_EQ(file.name, "beamer");
  EXPECT_EQ(file.lens.width, 1280);
  EXPECT_EQ(file.lens.height, 800);
  EXPECT_EQ(file.lens.K(1, 1), 1901);
  EXPECT_EQ(file.lens.K(1, 2), 817);
  EXPECT_EQ(file.lens.D[4], 0.003);
  EXPECT_EQ(file.warning, "");
}

TEST_F(CameraInfoFileTest, readsTheMessageAsEchoed) {
  const CameraInfoFile file = load(R"(
header: {seq: 0, stamp: {secs: 0, nsecs: 0}, frame_id: 'optical'}
height: 600
width: 800
distortion_model: rational_polynomial
D: [0.1, 0.2, 0, 0, 0.3, 0.4, 0.5, 0.6]
K: [1000.0, 0.0, 400.0, 0.0, 1000.0, 300.0, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [1000.0, 0.0, 400, 0.0, 0.0, 1000.0, 300.0, 0.0, 0.0, 0.0, 1.0, 0.0]
)");
  EXPECT_EQ(file.name, "optical");
  EXPECT_EQ(file.lens.height, 600);
  EXPECT_EQ(file.lens.D[7], 0.6);
}

class ProjectorInfo : public CameraInfoFileTest,
                      public testing::WithParamInterface<test::Source> {};

TEST_P(ProjectorInfo, takesKWherePDisagrees) {
  const bool is_real = GetParam() == test::Source::Real;
  const CameraInfoFile file = load(test::projectorInfo(GetParam()));
  EXPECT_EQ(file.name, is_real ? "proj_view" : "beamer");
  EXPECT_EQ(file.lens.K(1, 2), 817);
  EXPECT_EQ(file.warning, "K and P disagree (cy 817 against " +
                              std::string(is_real ? "750" : "770.5") +
                              " px): K is used, P is for rectified images only");
}

INSTANTIATE_TEST_SUITE_P(On, ProjectorInfo, test::sources(), test::sourceName);

TEST_F(CameraInfoFileTest, takesFourNumbersAndNoneAtAll) {
  EXPECT_EQ(load(with("[-0.1, 0.02, 0.001, -0.002, 0.003]", "[1, 2, 3, 4]")).lens.D[3], 4);
  EXPECT_EQ(load(with("[-0.1, 0.02, 0.001, -0.002, 0.003]", "[]")).lens.D[0], 0);
  const std::string no_model = with("distortion_model: plumb_bob", "distortion_model: ''");
  EXPECT_EQ(refusal(no_model), path_ +
                                   ": distortion_model: missing, but "
                                   "distortion_coefficients is not zero");
}

TEST_F(CameraInfoFileTest, readsEquidistantLensesAndTheirOlderName) {
  for (const char* name : {"equidistant", "fisheye"}) {
    std::string text = with("[-0.1, 0.02, 0.001, -0.002, 0.003]", "[0.1, 0.02, 0.03, 0.04]");
    text.replace(text.find("plumb_bob"), 9, name);
    const Lens lens = load(text).lens;
    EXPECT_EQ(lens.model, LensModel::Equidistant);
    EXPECT_EQ(lens.D[3], 0.04);
  }
  expectRefusal(with("plumb_bob", "equidistant"), {"equidistant has 4 numbers, found 5"});
}

// OpenCV calibrates with 4, 5, 8, 12 or 14 numbers; REP 104's models have 5, 8 and 4.
TEST_F(CameraInfoFileTest, takesMoreNumbersThanTheModelHasWhereTheyAreZero) {
  const auto load14 = [&](const std::string& model, const std::string& numbers) {
    std::string text = with("[-0.1, 0.02, 0.001, -0.002, 0.003]", "[" + numbers + "]");
    text.replace(text.find("plumb_bob"), 9, model);
    return text;
  };
  EXPECT_EQ(load(load14("equidistant", "0.1, 0.02, 0.03, 0.04, 0")).lens.D[3], 0.04);
  EXPECT_EQ(load(load14("plumb_bob", "-0.1, 0.02, 0, 0, 0.003, 0, 0, 0")).lens.D[4], 0.003);
  const std::string eight = "-0.1, 0.02, 0, 0, 0.003, 0.1, 0.2, 0.3";
  EXPECT_EQ(load(load14("rational_polynomial", eight + ", 0, 0, 0, 0, 0, 0")).lens.D[7], 0.3);
  EXPECT_EQ(load(load14("rational_polynomial", eight + ", 0, 0, 0, 0")).lens.D[7], 0.3);
  expectRefusal(load14("plumb_bob", eight), {"plumb_bob has 4 or 5 numbers, found 8, and those "
                                             "beyond are not all 0"});
  expectRefusal(load14("rational_polynomial", eight + ", 0, 0, 0, 1e-3"),
                {"rational_polynomial has 8 numbers, found 12, and those beyond are not all 0"});
}

TEST_F(CameraInfoFileTest, comparesPWhereItCanAndOtherwiseDoesNotLookAtIt) {
  const std::string text =
      "{width: 640, height: 480, distortion_model: '', D: [], K: [500, 0, 320, 0, 500, 240, 0, 0, "
      "1], P: ";
  for (const char* P : {"[1, 2]", "[.nan, 0, 320, 0, 0, 500, 240, 0, 0, 0, 1, 0]", "none"}) {
    EXPECT_EQ(load(text + P + "}").warning, "") << P;
  }
}

TEST_F(CameraInfoFileTest, refusesSizesThatNoPictureHas) {
  expectRefusal("{width: 65535, height: 65535, distortion_model: '', D: [], "
                "K: [500, 0, 320, 0, 500, 240, 0, 0, 1]}",
                {"image size 65535 x 65535: expected at most 16384 pixels a side"});
}

TEST_F(CameraInfoFileTest, refusesOtherModelsByName) {
  expectRefusal(with("plumb_bob", "fov"), {"distortion_model: \"fov\" is not supported"});
  expectRefusal(with("plumb_bob", "rational_polynomial"), {"has 8 numbers, found 5"});
}

TEST_F(CameraInfoFileTest, saysThatACameraIsNotCalibrated) {
  const std::string said = refusal(
      "{width: 640, height: 480, distortion_model: '', D: [], "
      "K: [0, 0, 0, 0, 0, 0, 0, 0, 0]}");
  EXPECT_EQ(said, path_ + ": K: is all zero: this camera is not calibrated; calibrate it first");
}

TEST_F(CameraInfoFileTest, namesAllThatIsWrongAtOnce) {
  std::string text =
      with("[1900, 0, 640, 0, 1901, 817, 0, 0, 1]}\n", "[0, 0, .nan, 0, x, 817, 0, 0, 1]}\n");
  text.replace(text.find("image_width: 1280"), 17, "image_width: wide");
  text.replace(text.find("image_height: 800"), 17, "image_heigth: 800");
  text.replace(text.find("plumb_bob"), 9, "fisheye62");
  expectRefusal(text, {"image_width: line 2 has \"wide\"", "image_height: missing",
                       "camera_matrix: line 5 has \".nan\"", "camera_matrix: line 5 has \"x\"",
                       "K[0] (fx) is 0", "\"fisheye62\""});
}

TEST_F(CameraInfoFileTest, isNotWaitedForIfItIsAPipe) {
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  EXPECT_THROW(loadCameraInfo(path_), std::runtime_error);
  EXPECT_THROW(loadYamlValues(path_), std::runtime_error);
  EXPECT_THROW(loadCameraInfo("/dev/zero"), std::runtime_error) << "it has no end";
}

TEST_F(CameraInfoFileTest, refusesWhatIsNoCameraInfo) {
  expectRefusal("a: 1\n", {"expected camera_matrix or K"});
  expectRefusal("", {"expected camera_matrix or K"});
  expectRefusal("[1, 2\n", {"is not YAML"});
  expectRefusal(with("[1900, 0, 640, 0, 1901, 817, 0, 0, 1]}\n", "[1, 2]}\n"),
                {"camera_matrix: expected 9 numbers, found 2"});
  EXPECT_THROW(loadCameraInfo(folder_.path("none.yaml")), std::runtime_error);
}

}  // namespace
}  // namespace afterglow::calib::camera_info_file_test

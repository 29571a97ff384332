#include "calib/report/calibration_files.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <locale>

#include "calib/camera_info_file.hpp"
#include "calib/file_replacement.hpp"
#include "calib/number_text.hpp"
#include "tests/support/referee_program.hpp"
#include "tests/support/sample_calibration.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::calib::calibration_files_test {
namespace {

using test::fileBytes;

namespace fs = std::filesystem;

constexpr const char* kDate = "2026-11-21T04:30:00Z";
constexpr const char* kLaterDate = "2026-11-22T09:05:07Z";

/// Decimals as in most of Europe, thousands grouped.
struct CommaDecimals : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

class CommaLocale {
 public:
  CommaLocale()
      : before_(std::locale::global(std::locale(std::locale::classic(), new CommaDecimals))) {}
  ~CommaLocale() { std::locale::global(before_); }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

 private:
  std::locale before_;
};

/// Writing more than so many bytes to a file fails, as on a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "accepted";
}

const Calibration& sample() {
  static const Calibration calibration = test::sampleCalibration();
  return calibration;
}

class CalibrationFilesTest : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path("out/" + name); }
  std::string folder() const { return folder_.path("out"); }
  void save(const Calibration& calibration, const std::string& date = kDate) const {
    saveCalibration(folder(), calibration, {}, date);
  }
  /// Every path below the folder, sorted.
  std::vector<std::string> everything() const {
    std::vector<std::string> paths;
    if (!fs::exists(folder())) return paths;
    for (const auto& entry : fs::recursive_directory_iterator(folder())) {
      paths.push_back(fs::relative(entry.path(), folder()).string());
    }
    std::sort(paths.begin(), paths.end());
    return paths;
  }
  void change(const std::string& name, const std::string& from, const std::string& to) const {
    std::string text = fileBytes(path(name));
    ASSERT_NE(text.find(from), std::string::npos) << from << " in " << text;
    std::ofstream(path(name)) << text.replace(text.find(from), from.size(), to);
  }
  void expectSame(const ProjectorEstimate& a, const ProjectorEstimate& b) const {
    EXPECT_EQ(a.projector.K, b.projector.K);
    EXPECT_EQ(a.projector.D, b.projector.D);
    EXPECT_EQ(a.projector.width, b.projector.width);
    EXPECT_EQ(a.projector.height, b.projector.height);
    EXPECT_EQ(a.T_camera_projector.matrix().matrix(), b.T_camera_projector.matrix().matrix());
    EXPECT_EQ(a.covariance, b.covariance);
  }
  void expectRefused(const std::string& file, const std::vector<std::string>& parts) const {
    const std::string said = refusal([&] { loadCalibration(folder()); });
    EXPECT_EQ(said.rfind(path(file) + ": ", 0), 0u) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    for (const std::string& part : parts) EXPECT_NE(said.find(part), std::string::npos) << said;
  }

  test::TempFolder folder_;
  const Calibration calibration_ = sample();
};

TEST_F(CalibrationFilesTest, readsBackExactlyWhatWasSaved) {
  save(calibration_);
  expectSame(loadCalibration(folder()), calibration_.estimate);
  EXPECT_EQ(everything(),
            (std::vector<std::string>{"T_camera_projector.yaml", "calibration.yaml", "camera.yaml",
                                      "history", std::string("history/") + kDate + ".yaml",
                                      "projector.yaml"}));
  EXPECT_EQ(fileBytes(path("calibration.yaml")), fileBytes(path(std::string("history/") + kDate + ".yaml")));
}

TEST_F(CalibrationFilesTest, writesACameraInfoFileWithoutAWarning) {
  save(calibration_);
  const CameraInfoFile plumb_bob = loadCameraInfo(path("projector.yaml"));
  EXPECT_EQ(plumb_bob.warning, "");
  EXPECT_EQ(plumb_bob.name, "projector");
  EXPECT_NE(fileBytes(path("projector.yaml")).find("distortion_model: plumb_bob"), std::string::npos);
  Calibration rational = calibration_;
  rational.estimate.projector.D[6] = 1.0 / 3;
  save(rational);
  EXPECT_NE(fileBytes(path("projector.yaml")).find("distortion_model: rational_polynomial"),
            std::string::npos);
  expectSame(loadCalibration(folder()), rational.estimate);
}

TEST_F(CalibrationFilesTest, remembersThatTheCameraIsAFisheye) {
  Calibration fisheye = calibration_;
  const Lens& camera = calibration_.camera;
  fisheye.camera = makeLens(camera.width, camera.height, camera.K, {0.1, 0.02, 0.03, 0.04},
                            LensModel::Equidistant);
  save(fisheye);
  EXPECT_NE(fileBytes(path("calibration.yaml")).find("\n  model: equidistant\n"), std::string::npos);
  expectSame(loadCalibration(folder()), fisheye.estimate);
  EXPECT_NE(projectorYaml(fisheye.camera, "camera").find("distortion_model: equidistant"),
            std::string::npos);
}

TEST_F(CalibrationFilesTest, namesItsFrames) {
  saveCalibration(folder(), calibration_, {"head \"left\"", "beamer", "p"}, kDate);
  const std::string text = fileBytes(path("T_camera_projector.yaml"));
  EXPECT_NE(text.find("parent_frame: \"head \\\"left\\\"\"\n"), std::string::npos) << text;
  EXPECT_NE(text.find("child_frame: \"beamer\"\n"), std::string::npos) << text;
}

TEST_F(CalibrationFilesTest, writesAndReadsTheSameWhereDecimalsHaveCommas) {
  save(calibration_);
  const std::string here = fileBytes(path("calibration.yaml")) + fileBytes(path("projector.yaml"));
  const CommaLocale elsewhere;
  expectSame(loadCalibration(folder()), calibration_.estimate);
  save(calibration_);
  EXPECT_EQ(fileBytes(path("calibration.yaml")) + fileBytes(path("projector.yaml")), here);
}

TEST_F(CalibrationFilesTest, changesNothingWhenTheDiskIsFull) {
  save(calibration_);
  const std::vector<std::string> before = everything();
  const std::string old_text = fileBytes(path("projector.yaml"));
  Calibration newer = calibration_;
  newer.estimate.projector.K(0, 0) += 7;
  std::string said;
  {
    const FullDisk full(2000);  // the small files fit, calibration.yaml does not
    said = refusal([&] { save(newer, kLaterDate); });
  }
  EXPECT_NE(said.find(".yaml: cannot be written: File too large"), std::string::npos) << said;
  EXPECT_EQ(everything(), before);
  EXPECT_EQ(fileBytes(path("projector.yaml")), old_text);
  expectSame(loadCalibration(folder()), calibration_.estimate);
}

TEST_F(CalibrationFilesTest, leavesNothingBehindWhenTheFirstSaveFails) {
  {
    const FullDisk full(2000);
    EXPECT_NE(refusal([&] { save(calibration_); }), "accepted");
  }
  EXPECT_FALSE(fs::exists(folder()));
}

TEST_F(CalibrationFilesTest, refusesAFolderWhereAFileShouldBe) {
  save(calibration_);
  fs::remove(path("calibration.yaml"));
  fs::create_directory(path("calibration.yaml"));
  const std::vector<std::string> before = everything();
  const std::string said = refusal([&] { save(calibration_, kLaterDate); });
  EXPECT_EQ(said, path("calibration.yaml") +
                      ": cannot be written: Is a directory (what was there before is unchanged)");
  EXPECT_EQ(everything(), before);
}

TEST_F(CalibrationFilesTest, refusesAFileWhereTheFolderShouldBe) {
  std::ofstream(folder()) << "a file";
  const std::string said = refusal([&] { save(calibration_); });
  EXPECT_NE(said.find(folder() + ": cannot be written: Not a directory"), std::string::npos)
      << said;
  EXPECT_EQ(fileBytes(folder()), "a file");
}

TEST_F(CalibrationFilesTest, writesThroughALinkAndKeepsIt) {
  fs::create_directories(folder_.path("elsewhere"));
  fs::create_directories(folder());
  std::ofstream(folder_.path("elsewhere/p.yaml")) << "old";
  fs::create_symlink("../elsewhere/p.yaml", path("projector.yaml"));
  save(calibration_);
  EXPECT_TRUE(fs::is_symlink(path("projector.yaml")));
  EXPECT_NE(fileBytes(folder_.path("elsewhere/p.yaml")).find("camera_matrix"), std::string::npos);
}

TEST_F(CalibrationFilesTest, savesNoEstimateThatIsNotFinite) {
  Calibration broken = calibration_;
  broken.estimate.covariance(2, 3) = std::nan("");
  EXPECT_NE(refusal([&] { save(broken); }), "accepted");
  EXPECT_NE(refusal([&] { save(calibration_, "../../tomorrow"); }), "accepted");
  EXPECT_TRUE(everything().empty());
}

TEST_F(CalibrationFilesTest, looksThroughTheRefinedCameraInsteadOfTheOneItWasGiven) {
  Calibration refined = calibration_;
  refined.camera_info = refined.camera;
  refined.camera_info.K(0, 2) += 2;
  save(refined);
  EXPECT_EQ(cameraOf(folder(), {}).K, refined.camera.K);
  EXPECT_EQ(cameraOf(folder(), refined.camera_info).K, refined.camera.K);
  EXPECT_EQ(loadCameraInfo(path("camera.yaml")).lens.K, refined.camera.K);
  Lens newer = refined.camera;
  newer.K(0, 0) += 1;
  EXPECT_EQ(cameraOf(folder(), newer).K, newer.K) << "calibrated since";
  EXPECT_EQ(cameraOf(folder() + "/older", newer).K, newer.K);
}

TEST_F(CalibrationFilesTest, loadsWithoutTheEvidence) {
  save(calibration_);
  fs::remove(path("calibration.yaml"));
  ProjectorEstimate expected = calibration_.estimate;
  expected.covariance.setZero();
  expectSame(loadCalibration(folder()), expected);
}

TEST_F(CalibrationFilesTest, noticesFilesOfTwoCalibrations) {
  save(calibration_);
  const std::string older = fileBytes(path("projector.yaml"));
  Calibration newer = calibration_;
  newer.estimate.projector.K(0, 2) += 0.25;
  save(newer, kLaterDate);
  std::ofstream(path("projector.yaml")) << older;
  expectRefused("projector.yaml", {"not of the same calibration", "remove calibration.yaml"});
}

TEST_F(CalibrationFilesTest, refusesKAndPThatDisagree) {
  save(calibration_);
  std::string text = fileBytes(path("projector.yaml"));
  text.replace(text.rfind("817.4"), 5, "750.0");
  std::ofstream(path("projector.yaml")) << text;
  expectRefused("projector.yaml", {"K and P disagree", "cy 817.4 against 750"});
}

TEST_F(CalibrationFilesTest, refusesAMatrixThatIsNotRigid) {
  const auto with = [&](const std::string& rows) {
    std::ofstream(folder_.path("T.yaml")) << "T_camera_projector:\n" << rows;
    return refusal([&] { loadTCameraProjector(folder_.path("T.yaml")); });
  };
  const std::string place = folder_.path("T.yaml") + ": T_camera_projector: ";
  const std::string last = "  - [0, 0, 0, 1]\n";
  const std::string good = "  - [1, 0, 0, 0.1]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n";
  EXPECT_EQ(with(good + last), "accepted");
  EXPECT_EQ(with("  [1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"), "accepted");
  EXPECT_EQ(with(good + "  - [0, 0, 0, 2]\n"), place + "the last row must be 0 0 0 1");
  EXPECT_EQ(with(good), place + "expected 16 numbers, found 12");
  EXPECT_EQ(with(good + "  - [0, 0, 0, one]\n"),
            place + "line 5 has \"one\", expected a finite number");
  EXPECT_EQ(with(good + "  - [0, 0, .nan, 1]\n"),
            place + "line 5 has \".nan\", expected a finite number");
  EXPECT_NE(with("  - [2, 0, 0, 0]\n  - [0, 2, 0, 0]\n  - [0, 0, 2, 0]\n" + last)
                .find("is not rigid: its upper left 3 x 3 is no rotation"),
            std::string::npos);
  EXPECT_NE(with("  - [-1, 0, 0, 0]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n" + last)
                .find("is not rigid: it mirrors"),
            std::string::npos);
  EXPECT_EQ(with("  - [1, 0, 0, 94]\n  - [0, 1, 0, 90]\n  - [0, 0, 1, 60]\n" + last),
            place + "camera and projector are 143.3 m apart; expected meters, not millimeters");
  EXPECT_EQ(refusal([&] { loadTCameraProjector(folder_.path("none.yaml")); }),
            folder_.path("none.yaml") + ": cannot be read");
}

TEST_F(CalibrationFilesTest, refusesDamagedEvidence) {
  save(calibration_);
  change("calibration.yaml", "format: 1", "format: 7");
  expectRefused("calibration.yaml", {"format: is 7; this version reads 1"});
  save(calibration_);
  change("calibration.yaml", "held_out_rms_px", "held_out");
  expectRefused("calibration.yaml", {"held_out_rms_px: missing"});
  save(calibration_);
  change("calibration.yaml", "covariance:\n  - [", "covariance:\n  - [-");
  expectRefused("calibration.yaml", {"covariance: expected a symmetric matrix"});
  save(calibration_);
  std::ofstream(path("calibration.yaml")) << "a: [1, 2";
  expectRefused("calibration.yaml", {"is not YAML"});
  save(calibration_);
  std::ofstream(path("calibration.yaml")) << "";
  expectRefused("calibration.yaml", {"holds no keys"});
}

TEST_F(CalibrationFilesTest, refusesATruncatedFileAtAnyLength) {
  save(calibration_);
  const std::string whole = fileBytes(path("T_camera_projector.yaml"));
  for (std::size_t length = 0; length < whole.size() - 6; length += 3) {
    std::ofstream(path("T_camera_projector.yaml")) << whole.substr(0, length);
    EXPECT_NE(refusal([&] { loadCalibration(folder()); }), "accepted") << length;
  }
}

TEST_F(CalibrationFilesTest, isReadByTheReferee) {
  const std::string absence = test::refereeAbsence();
  if (!absence.empty()) GTEST_SKIP() << absence;
  Calibration tiny_terms = calibration_;
  tiny_terms.estimate.projector.D[2] = 3e-7;  // a number with an exponent
  save(tiny_terms);
  const ProjectorEstimate& truth = tiny_terms.estimate;
  const auto lens = [](const Lens& from) {
    std::string text = "{width: " + std::to_string(from.width) +
                       ", height: " + std::to_string(from.height) + ", K: [";
    for (int i = 0; i < 9; ++i) text += (i > 0 ? ", " : "") + exactText(from.K(i / 3, i % 3));
    text += "], D: [";
    for (std::size_t i = 0; i < 8; ++i) text += (i > 0 ? ", " : "") + exactText(from.D[i]);
    return text + "]}\n";
  };
  const auto rigid = [](const Eigen::Matrix4d& T) {
    std::string text = "[";
    for (int i = 0; i < 16; ++i) {
      text += (i % 4 > 0 ? ", " : i > 0 ? "], [" : "[") + exactText(T(i / 4, i % 4));
    }
    return text + "]]\n";
  };
  // The camera is the world.
  std::ofstream(folder_.path("truth.yaml"))
      << "projector: " << lens(truth.projector) << "camera: " << lens(tiny_terms.camera)
      << "T_world_camera: " << rigid(Eigen::Matrix4d::Identity())
      << "T_world_projector: " << rigid(truth.T_camera_projector.matrix().matrix());
  const std::string said = folder_.path("said");
  const int status = test::runReferee("compare --max-p95-mm 0.000001 --truth " +
                                          folder_.path("truth.yaml") + " --projector " +
                                          path("projector.yaml") + " --pose " +
                                          path("T_camera_projector.yaml") + " >> " + said,
                                      said);
  EXPECT_EQ(status, 0) << fileBytes(said);
}

TEST_F(CalibrationFilesTest, keepsAHistoryInOrderAndNamesWhatItCannotRead) {
  Calibration newer = calibration_;
  newer.held_out_rms_mm = 0.5;
  save(newer, kLaterDate);
  save(calibration_, kDate);
  std::ofstream(path("history/2026-01-01T00:00:00Z.yaml")) << "date: yesterday\n";
  std::ofstream(path("history/notes.txt")) << "not a calibration";
  std::vector<std::string> problems;
  const std::vector<CalibrationRecord> history = calibrationHistory(folder(), problems);
  ASSERT_EQ(history.size(), 2u);
  EXPECT_EQ(history[0].date, kDate);
  EXPECT_EQ(history[1].date, kLaterDate);
  EXPECT_EQ(history[1].held_out_rms_mm, 0.5);
  EXPECT_EQ(history[1].views_used, 14);
  expectSame(history[0].estimate, calibration_.estimate);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems[0], path("history/2026-01-01T00:00:00Z.yaml") + ": format: missing");
}

TEST_F(CalibrationFilesTest, hasNoHistoryBeforeTheFirst) {
  std::vector<std::string> problems;
  EXPECT_TRUE(calibrationHistory(folder(), problems).empty());
  EXPECT_TRUE(problems.empty());
}

TEST(NumberText, readsBackExactly) {
  for (const double value :
       {0.1, 1.0 / 3, -2e-9, 1e-300, 1900.0, 5e22, -0.0, 123456789.123456789}) {
    EXPECT_EQ(numberFromText(exactText(value)), value) << exactText(value);
  }
  EXPECT_EQ(exactText(0.1), "0.1");
  EXPECT_EQ(exactText(1e-5), "1.0e-05");
  EXPECT_EQ(fixedText(-0.004, 2), "0.00");
  EXPECT_FALSE(numberFromText("1,5"));
  EXPECT_FALSE(numberFromText(""));
  EXPECT_FALSE(numberFromText("1 "));
}

TEST(FileReplacement, takesBackWhatItHasRenamedWhenALaterFileFails) {
  const test::TempFolder folder;
  replaceFile(folder.path("old.txt"), "old");
  {
    FileReplacement replacement;
    replacement.add(folder.path("old.txt"), "new");
    replacement.add(folder.path("made/first.txt"), "new");
    replacement.add(folder.path("blocked.txt"), "new");
    fs::create_directory(folder.path("blocked.txt"));
    EXPECT_EQ(refusal([&] { replacement.commit(); }),
              folder.path("blocked.txt") +
                  ": cannot be written: Is a directory (what was there before is unchanged)");
  }
  std::ifstream file(folder.path("old.txt"));
  std::string text;
  file >> text;
  EXPECT_EQ(text, "old");
  std::vector<std::string> left;
  for (const auto& entry : fs::directory_iterator(folder.path(""))) {
    left.push_back(entry.path().filename().string());
  }
  std::sort(left.begin(), left.end());
  EXPECT_EQ(left, (std::vector<std::string>{"blocked.txt", "old.txt"}));
}

TEST(ReplaceFile, replacesAtomicallyOrNotAtAll) {
  const test::TempFolder folder;
  replaceFile(folder.path("a/b.txt"), "one");
  replaceFile(folder.path("a/b.txt"), "two");
  std::ifstream file(folder.path("a/b.txt"));
  std::string text;
  file >> text;
  EXPECT_EQ(text, "two");
  fs::create_directory(folder.path("c"));
  EXPECT_EQ(refusal([&] { replaceFile(folder.path("c"), "three"); }),
            folder.path("c") +
                ": cannot be written: Is a directory (what was there before is unchanged)");
}

}  // namespace
}  // namespace afterglow::calib::calibration_files_test

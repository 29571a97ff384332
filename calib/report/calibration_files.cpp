#include "calib/report/calibration_files.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "calib/camera_info_file.hpp"
#include "calib/file_replacement.hpp"
#include "calib/report/calibration_yaml.hpp"

namespace afterglow::calib {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProjectorFile = "projector.yaml";
constexpr const char* kTransformFile = "T_camera_projector.yaml";
constexpr const char* kCameraFile = "camera.yaml";
constexpr const char* kCalibrationFile = "calibration.yaml";
constexpr const char* kHistoryFolder = "history";

std::string in(const std::string& folder, const std::string& name) {
  return (fs::path(folder) / name).string();
}

/// A solver gone wrong must not replace a calibration that works.
void checkFinite(const Calibration& calibration) {
  const ProjectorEstimate& estimate = calibration.estimate;
  if (!lensViolations(estimate.projector.width, estimate.projector.height, estimate.projector.K,
                      {estimate.projector.D.begin(), estimate.projector.D.end()})
           .empty() ||
      !estimate.T_camera_projector.matrix().matrix().allFinite() ||
      !estimate.covariance.allFinite() || !std::isfinite(calibration.held_out_rms_px) ||
      !std::isfinite(calibration.held_out_rms_mm)) {
    throw std::invalid_argument("saveCalibration: the calibration holds impossible numbers");
  }
}

bool isSameLens(const Lens& a, const Lens& b) {
  return a.K == b.K && a.D == b.D && a.width == b.width && a.height == b.height &&
         a.model == b.model;
}

/// A power cut between two renames, or an editor, can leave files of two calibrations side by side.
void checkOneCalibration(const std::string& folder, const ProjectorEstimate& files,
                         const ProjectorEstimate& record) {
  const bool same_lens = isSameLens(files.projector, record.projector);
  const bool same_pose =
      files.T_camera_projector.matrix().matrix() == record.T_camera_projector.matrix().matrix();
  if (same_lens && same_pose) return;
  throw std::runtime_error(
      in(folder, same_lens ? kTransformFile : kProjectorFile) +
      ": is not of the same calibration as calibration.yaml beside it; copy the three files of one "
      "calibration here, or remove calibration.yaml to go without its uncertainty");
}

}  // namespace

void saveCalibration(const std::string& folder, const Calibration& calibration,
                     const CalibrationNames& names, const std::string& date) {
  if (!isDate(date)) {
    throw std::invalid_argument("saveCalibration: date is \"" + date +
                                "\", expected UTC as 2026-11-21T04:30:00Z");
  }
  checkFinite(calibration);
  const std::string evidence = calibrationYaml(calibration, names, date);
  FileReplacement replacement;
  replacement.add(in(folder, kProjectorFile),
                  projectorYaml(calibration.estimate.projector, names.projector_name));
  replacement.add(in(folder, kTransformFile),
                  transformYaml(calibration.estimate.T_camera_projector, names));
  replacement.add(in(folder, kCameraFile), projectorYaml(calibration.camera, names.camera_name));
  replacement.add(in(in(folder, kHistoryFolder), date + ".yaml"), evidence);
  replacement.add(in(folder, kCalibrationFile), evidence);
  replacement.commit();
}

ProjectorEstimate loadCalibration(const std::string& folder) {
  const std::string projector_path = in(folder, kProjectorFile);
  const CameraInfoFile projector = loadCameraInfo(projector_path);
  if (!projector.warning.empty()) {
    throw std::runtime_error(projector_path + ": " + projector.warning +
                             "; a projector's picture is not rectified, so they must be equal");
  }
  ProjectorEstimate estimate;
  estimate.projector = projector.lens;
  estimate.T_camera_projector = loadTCameraProjector(in(folder, kTransformFile));
  const std::string calibration_path = in(folder, kCalibrationFile);
  if (fs::exists(calibration_path)) {
    const CalibrationRecord record = loadRecord(calibration_path);
    checkOneCalibration(folder, estimate, record.estimate);
    estimate.covariance = record.estimate.covariance;
  }
  return estimate;
}

Lens cameraOf(const std::string& folder, const std::optional<Lens>& given) {
  const std::string path = in(folder, kCalibrationFile);
  std::optional<CalibrationRecord> record;
  if (fs::exists(path)) record = loadRecord(path);
  if (!record || !record->camera) {
    if (given) return *given;
    throw std::runtime_error(path + ": does not say which camera it was made with: give --camera");
  }
  const bool is_of_calibration =
      !given || (record->camera_info && isSameLens(*given, *record->camera_info));
  return is_of_calibration ? *record->camera : *given;
}

std::vector<CalibrationRecord> calibrationHistory(const std::string& folder,
                                                  std::vector<std::string>& problems) {
  const std::string history = in(folder, kHistoryFolder);
  std::vector<CalibrationRecord> records;
  std::error_code error;
  if (!fs::exists(history, error)) return records;
  std::vector<std::string> paths;
  for (fs::directory_iterator entry(history, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    const bool is_hidden = path.filename().string().front() == '.';
    if (path.extension() == ".yaml" && !is_hidden) paths.push_back(path.string());
  }
  if (error) problems.push_back(history + ": cannot be read: " + error.message());
  std::sort(paths.begin(), paths.end());
  for (const std::string& path : paths) {
    try {
      records.push_back(loadRecord(path));
    } catch (const std::runtime_error& problem) {
      problems.push_back(problem.what());
    }
  }
  std::stable_sort(records.begin(), records.end(),
                   [](const auto& a, const auto& b) { return a.date < b.date; });
  return records;
}

}  // namespace afterglow::calib

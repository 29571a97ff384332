/// \file
/// A finished calibration on disk: the files the rest of the world reads, replaced all at once or
/// not at all, and the ones before them.
///
/// The texts of a calibration's three files, and calibration.yaml read back. Numbers are written so
/// that reading gives exactly them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

struct CalibrationNames {
  std::string camera_frame = "camera_optical_frame";
  std::string projector_frame = "projector_optical_frame";
  std::string projector_name = "projector";
  std::string camera_name = "camera";
};

/// An earlier calibration, from history/.
struct CalibrationRecord {
  std::string date;  ///< UTC, 2026-11-21T04:30:00Z
  ProjectorEstimate estimate;
  double held_out_rms_px = 0, held_out_rms_mm = 0;
  int views_used = 0;
  /// The camera as used and as given; empty in files that older versions wrote.
  std::optional<Lens> camera = std::nullopt, camera_info = std::nullopt;
};

/// Writes projector.yaml (camera_calibration_parsers), T_camera_projector.yaml (parent_frame,
/// child_frame, T_camera_projector 4 x 4), camera.yaml (the camera as T_camera_projector is about
/// it, perhaps refined), calibration.yaml (estimate, covariance, errors, views, date) into the
/// folder: each to a temporary file, fsync, rename, calibration.yaml last; a copy of
/// calibration.yaml goes to history/DATE.yaml. Throws std::runtime_error naming file and reason
/// (disk full, no permission); what was there before then still is. Throws std::invalid_argument
/// for a date of another form than CalibrationRecord's, or numbers that are not finite.
void saveCalibration(const std::string& folder, const Calibration& calibration,
                     const CalibrationNames& names, const std::string& date);

/// projector.yaml, T_camera_projector.yaml (and covariance from calibration.yaml where it is).
/// Throws std::runtime_error naming the file, key and value that are wrong.
ProjectorEstimate loadCalibration(const std::string& folder);
/// The camera to look through at what a calibration's light does. Its camera_info may have been
/// refined, and boards seen through the one seem to lie elsewhere than through the other. So: the
/// calibration's own camera where nothing, or the camera_info it was made with, is `given`;
/// otherwise the one given, calibrated since. Throws std::runtime_error as loadCalibration does,
/// and where none is given and the folder knows none.
Lens cameraOf(const std::string& folder, const std::optional<Lens>& given);
/// A 4 x 4 rigid matrix from T_camera_projector.yaml. Throws std::runtime_error if it is not rigid.
Rigid<Camera, Projector> loadTCameraProjector(const std::string& path);

/// Oldest first; unreadable ones are skipped and named in `problems`.
std::vector<CalibrationRecord> calibrationHistory(const std::string& folder,
                                                  std::vector<std::string>& problems);

/// The order of a covariance's rows, and their units.
struct ParameterName {
  const char* name;
  const char* unit;  ///< unit; "" for a number without one
};
extern const ParameterName kParameterNames[kCalibrationParameters];

/// The form of camera_calibration_parsers. P is K beside zeros: a projector's picture is not
/// rectified.
std::string projectorYaml(const Lens& projector, const std::string& name);
std::string transformYaml(const Rigid<Camera, Projector>& T_camera_projector,
                          const CalibrationNames& names);
std::string calibrationYaml(const Calibration& calibration, const CalibrationNames& names,
                            const std::string& date);

/// calibration.yaml or a copy of it. Throws std::runtime_error naming the file, key and value that
/// are wrong.
CalibrationRecord loadRecord(const std::string& path);

/// 2026-11-21T04:30:00Z, and nothing else: it becomes a file's name.
bool isDate(const std::string& text);

}  // namespace afterglow::calib

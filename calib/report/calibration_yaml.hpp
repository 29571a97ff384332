/// \file
/// The texts of a calibration's three files, and calibration.yaml read back. Numbers are written so
/// that reading gives exactly them.
#pragma once

#include <string>

#include "calib/report/calibration_files.hpp"

namespace afterglow::calib {

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

/// \file
/// The evidence for a calibration as data: what a report tells of it, in figures and words.
///
/// The meaning of a calibration's covariance for light on a surface, and the distance between two
/// calibrations.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/report/calibration_files.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

/// Facts for a report beside the calibration itself; unknown ones are not mentioned.
struct ReportFacts {
  CalibrationNames names;
  std::optional<Board> board;
  std::optional<Pattern> pattern;
};

/// `history` is what calibrationHistory gives, before or after this calibration was saved. Keys:
/// - date, projector_name, camera_frame, projector_frame; camera, projector and, where it was
///   given, camera_info: {width, height, fx, fy, cx, cy, is_equidistant, distortion}; camera_text
///   (what became of camera_info); board {width_mm, height_mm, tags, family, tag_mm}, pattern
///   {width, height, tags, family};
/// - held_out {rms_mm, rms_px, view_count, nearest_m, farthest_m}, null if no view was kept back;
///   training_rms_px, board_rms_px, predicted_mm, light {mm, px, distance_m, text} (what light is
///   off by in the room; null if nobody knows), board_text (how the board is bent; empty if it is
///   flat), is_camera_held, used_count, view_count, coverage (0 to 1), left_out [{name, reason}],
///   warnings [those about other things];
/// - views [viewData];
/// - lens {throw_ratio, wide_deg, shift (share of the height), shift_side, pixel_mm (at 1 m),
///   parameters}, pose {apart_mm (from the camera's lens), parameters, trade_off {across, down}
///   (correlations; null: held fixed)}; parameters [{name, value, deviation (null: held fixed),
///   meaning}];
/// - history [{date, view_count, held_out_px, held_out_mm, moved {px, mm, largest_mm} since the one
///   before (null: another resolution), is_first}], this calibration last.
nlohmann::ordered_json reportData(const Calibration& calibration,
                                  const std::vector<CalibrationRecord>& history,
                                  const std::string& date, const ReportFacts& facts = {});

/// name, is_used, reason, printed, projected (corners); of a used view also outliers, distance_m,
/// tilt_deg, turned (an arrow), training_px, training_mm, held_out_px, held_out_mm (null: not
/// measured).
nlohmann::ordered_json viewData(const ViewResult& view, const ProjectorEstimate& estimate);

/// Half the longest axis of the 95 % ellipse.
struct Uncertainty {
  double px = 0;
  double mm = 0;  ///< error on a surface facing the projector
};

/// Returns the uncertainty of the light for a point on the ray of a projector's pixel, at a
/// distance (m) along the optical axis. Empty if no ray within the lens's model reaches the pixel.
std::optional<Uncertainty> uncertaintyAt(const ProjectorEstimate& estimate,
                                         const Eigen::Vector2d& pixel, double distance_m);

/// uncertaintyAt over the projector's picture, cell by cell.
struct UncertaintyGrid {
  int columns = 0, rows = 0;
  double distance_m = 0;
  Eigen::Vector2d cell_px;                        ///< size of a cell in the projector's pixels
  std::vector<std::optional<Uncertainty>> cells;  ///< row-major, at the cells' centers

  const std::optional<Uncertainty>& at(int column, int row) const {
    return cells.at(static_cast<std::size_t>(row * columns + column));
  }
};
/// Four cells across and down for each one of Coverage.
UncertaintyGrid uncertaintyGrid(const ProjectorEstimate& estimate, double distance_m);

/// The movement of the light for fixed points in the camera's frame from one calibration to
/// another, root mean square over the projector's picture.
struct LightShift {
  double rms_px = 0, rms_mm = 0;
  double largest_mm = 0;
};

/// Points lie at a distance (m) along the former's axis. Empty if the pictures' sizes differ or no
/// point is lit by both.
std::optional<LightShift> shiftBetween(const ProjectorEstimate& before,
                                       const ProjectorEstimate& after, double distance_m);

}  // namespace afterglow::calib

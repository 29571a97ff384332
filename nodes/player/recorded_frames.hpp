/// \file
/// The recorded transforms of a behavior, from its recording's /tf and /tf_static.
#pragma once

#include <tf2/buffer_core.h>

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "replay/messages/robot_names.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Reads along as later moments are asked for, and anew where it is far from them: memory is that
/// of half a minute of tf. Keeps a reference to the store. No ROS master is involved; one thread at
/// a time.
class RecordedFrames {
 public:
  RecordedFrames(const replay::Store& store, const replay::Behavior& behavior, std::string anchor);

  /// The kinds of transforms that will do.
  enum class Wanted {
    Exact,  ///< a transform between two that were recorded
    Newest  ///< also the newest before, if it is at most 2 s older
  };
  /// T_anchor_frame at a moment of the robot's clock then. Empty if it was not recorded. Throws
  /// replay::StoreError.
  std::optional<Eigen::Isometry3d> at(const std::string& frame, replay::Stamp moment,
                                      Wanted wanted);
  /// Reads ahead, so that at() finds transforms until this moment without reading.
  void readTo(replay::Stamp moment);

  const std::string& anchor() const { return anchor_; }

 private:
  void restart(replay::Stamp moment);
  std::vector<std::string> withOwn(const std::string& topic) const;
  bool read();
  void feed(const replay::Message& message, bool is_static);
  std::optional<Eigen::Isometry3d> look(const std::string& frame, replay::Stamp moment) const;

  const replay::Store& store_;
  replay::Behavior behavior_;
  const std::string anchor_;
  const replay::RobotNames robot_;
  tf2::BufferCore buffer_;
  std::unique_ptr<replay::MessageCursor> cursor_;  ///< cursor; empty: nothing comes any more
  replay::Stamp begin_, read_to_;                  ///< span that the buffer holds
};

}  // namespace afterglow::nodes

/// \file
/// A ROS graph for the tests of one program: a master, a node handle, callbacks in a thread.
#pragma once

#include <gtest/gtest.h>
#include <ros/ros.h>

#include <cerrno>
#include <memory>

#include "tests/support/ros_master.hpp"

namespace afterglow::test {

/// `Base`: testing::Test, or what else the tests need. One suite a program: roscpp starts once.
template <typename Base>
class RosGraph : public Base {
 protected:
  static void SetUpTestSuite() {
    master_ = std::make_unique<RosMaster>();
    int argc = 0;
    ros::init(argc, nullptr, program_invocation_short_name, ros::init_options::NoSigintHandler);
    nh_ = std::make_unique<ros::NodeHandle>();
    spinner_ = std::make_unique<ros::AsyncSpinner>(1);
    spinner_->start();
  }
  static void TearDownTestSuite() {
    spinner_.reset();
    nh_.reset();
    ros::shutdown();
    master_.reset();
  }

  static inline std::unique_ptr<RosMaster> master_;
  static inline std::unique_ptr<ros::NodeHandle> nh_;
  static inline std::unique_ptr<ros::AsyncSpinner> spinner_;
};

}  // namespace afterglow::test

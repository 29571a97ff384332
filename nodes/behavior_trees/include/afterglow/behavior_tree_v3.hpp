/// \file
/// `<RecordBehavior>` and TreeObserver for BehaviorTree.CPP 3.
#pragma once

#include <behaviortree_cpp_v3/bt_factory.h>

#include "afterglow/record_behavior.hpp"
#include "afterglow/tree_observer.hpp"

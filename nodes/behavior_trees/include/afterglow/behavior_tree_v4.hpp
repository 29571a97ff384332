/// \file
/// `<RecordBehavior>` and TreeObserver for BehaviorTree.CPP 4.
#pragma once

#include <behaviortree_cpp/bt_factory.h>

#include "afterglow/record_behavior.hpp"
#include "afterglow/tree_observer.hpp"

// Loaded by factory.registerFromPlugin(): <RecordBehavior> without a line of code.
#include "afterglow/behavior_tree_v4.hpp"

BT_REGISTER_NODES(factory) { afterglow::nodes::registerRecordBehavior(factory); }

/// \file
/// Observes an unmodified tree of BehaviorTree.CPP, the same text for versions 3 and 4: include
/// behavior_tree_v3.hpp or behavior_tree_v4.hpp.
///
///     afterglow::nodes::TreeWatchOptions options;
///     options.record = {{"**/pick", {"", {"/gripper/command", "/tf"}}}};
///     afterglow::nodes::TreeObserver observer(tree, options);
///
/// Every change of a node's status is published (msg/TreeTransition.msg), and the chosen nodes are
/// recorded: from RUNNING to SUCCESS ("success"), FAILURE ("failure") or IDLE ("halted"). A node
/// that throws changes no status: its recording ends when the tree is halted or destroyed.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "afterglow/tree_watch.hpp"

namespace afterglow::nodes {

/// Make and destroy it while nobody ticks the tree, which must outlive it.
class TreeObserver {
 public:
  /// Throws as TreeWatch does.
  TreeObserver(const BT::Tree& tree, TreeWatchOptions options)
      : watch_(watched(tree), std::move(options)) {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      subscribers_.push_back(nodes_[i]->subscribeToStatusChange(
          [this, i](BT::TimePoint, const BT::TreeNode&, BT::NodeStatus from, BT::NodeStatus to) {
            watch_.onTransition(i, BT::toStr(from), BT::toStr(to));
          }));
    }
  }
  TreeObserver(const TreeObserver&) = delete;
  TreeObserver& operator=(const TreeObserver&) = delete;

  /// Returns the paths of all nodes, the root first: rules are matched with them.
  std::vector<std::string> paths() const { return watch_.paths(); }

 private:
  std::vector<WatchedNode> watched(const BT::Tree& tree) {
    std::vector<WatchedNode> found;
    if (BT::TreeNode* root = tree.rootNode()) {
      collect(root, {}, found);
    }
    return found;
  }

  void collect(BT::TreeNode* node, std::optional<std::size_t> parent,
               std::vector<WatchedNode>& found) {
    const std::size_t index = found.size();
    found.push_back({node->name(), node->registrationName(), node->UID(), parent});
    nodes_.push_back(node);
    if (const auto* control = dynamic_cast<const BT::ControlNode*>(node)) {
      for (BT::TreeNode* child : control->children()) {
        collect(child, index, found);
      }
    } else if (auto* decorator = dynamic_cast<BT::DecoratorNode*>(node)) {
      if (decorator->child()) {
        collect(decorator->child(), index, found);
      }
    }
  }

  std::vector<BT::TreeNode*> nodes_;
  TreeWatch watch_;
  std::vector<BT::TreeNode::StatusChangeSubscriber> subscribers_;  ///< first to go
};

}  // namespace afterglow::nodes

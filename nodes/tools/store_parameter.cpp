#include "nodes/tools/store_parameter.hpp"

#include "replay/store/store.hpp"

namespace afterglow::nodes {

void refuseStorePassword(const ros::NodeHandle& private_node, const std::string& store) {
  try {
    replay::refusePassword("~store", store);
  } catch (const replay::StoreError&) {
    private_node.deleteParam("store");
    throw;
  }
}

}  // namespace afterglow::nodes

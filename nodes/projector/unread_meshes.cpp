#include "nodes/projector/unread_meshes.hpp"

#include <chrono>
#include <utility>

namespace afterglow::nodes {

bool isRead(const FutureMesh& mesh) {
  return mesh.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

bool UnreadMeshes::add(UnreadMesh unread) {
  remove(unread.layer, unread.key());
  if (waiting_.size() >= kMost) return false;
  waiting_.push_back(std::move(unread));
  return true;
}

void UnreadMeshes::remove(std::size_t layer, const ContentKey& key) {
  waiting_.remove_if([&](const UnreadMesh& unread) {
    return unread.layer == layer && unread.key() == key;
  });
}

void UnreadMeshes::removeAll(std::size_t layer) {
  waiting_.remove_if([&](const UnreadMesh& unread) { return unread.layer == layer; });
}

std::vector<UnreadMesh> UnreadMeshes::takeRead() {
  std::vector<UnreadMesh> read;
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    if (isRead(it->mesh)) {
      read.push_back(std::move(*it));
      it = waiting_.erase(it);
    } else {
      ++it;
    }
  }
  return read;
}

}  // namespace afterglow::nodes

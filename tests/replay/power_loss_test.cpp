// What is left when the power goes at any moment: the program's changes of its files are listened
// to, then a disk is made that forgot what was not synced, or any part of it, and looked at.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "tests/support/lossy_disk.hpp"
#include "tests/support/store_scenes.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::power_loss_test {
namespace {

using namespace afterglow::test;
using Unsynced = LossyDisk::Unsynced;

/// How many of the cuts that are not at a sync are looked at; $AFTERGLOW_TEST_CUTS says more.
std::size_t sampledCuts() {
  const char* asked = std::getenv("AFTERGLOW_TEST_CUTS");
  return asked ? std::strtoul(asked, nullptr, 10) : 20;
}

/// Knows what was kept when.
class Journal : public Witness {
 public:
  explicit Journal(const std::string& folder) : disk_(folder) {}
  void onKept(const Kept& kept) override { kept_[disk_.size()] = kept; }
  void onError(const std::string& text) override { ADD_FAILURE() << text; }
  const LossyDisk& disk() const { return disk_; }
  /// What was kept after the first `count` changes.
  Kept keptAt(std::size_t count) const {
    const auto later = kept_.upper_bound(count);
    return later == kept_.begin() ? Kept{} : std::prev(later)->second;
  }

 private:
  LossyDisk disk_;
  std::map<std::size_t, Kept> kept_;
};

void expectNothingLost(const Scene& scene) {
  const TempFolder folder;
  Journal journal(folder.path(""));
  scene(folder.path(""), journal);
  listenToFiles(nullptr);
  const LossyDisk& disk = journal.disk();
  ASSERT_GT(disk.size(), 10u);
  const std::size_t stride = std::max<std::size_t>(1, disk.size() / sampledCuts());
  for (std::size_t count = 0; count <= disk.size(); ++count) {
    const bool is_sampled = count % stride == 0 || count == disk.size();
    // Just before a sync most is at stake; just after it something has been acknowledged by it.
    std::vector<Unsynced> left_behind;
    if (is_sampled || (count > 0 && disk.isSync(count - 1))) left_behind = {Unsynced::Lost};
    if (is_sampled || (count < disk.size() && disk.isSync(count))) {
      left_behind.push_back(Unsynced::Random);
    }
    if (is_sampled) left_behind.push_back(Unsynced::Kept);
    for (const Unsynced unsynced : left_behind) {
      const TempFolder left;
      disk.leave(count, unsynced, static_cast<std::uint32_t>(count), left.path(""));
      ASSERT_EQ(faultsIn(left.path(""), journal.keptAt(count)), std::vector<std::string>{})
          << "after " << count << " of " << disk.size() << " changes, unsynced "
          << static_cast<int>(unsynced);
    }
  }
}

TEST(PowerLoss, takesNothingOfWhatTheRecorderHasAcknowledged) { expectNothingLost(scenes::record); }

TEST(PowerLoss, takesNothingOfWhatAStoreHasAppendedFoldedAndCompacted) {
  expectNothingLost(scenes::append);
}

TEST(PowerLoss, leavesAnImportWholeOrNotThere) {
  const TempFolder inputs;
  const std::string file = inputs.path("one.bag");
  scenes::writeRecording(file, RecordingFormat::Rosbag);
  expectNothingLost(
      [&](const std::string& folder, Witness& witness) { scenes::import(file, folder, witness); });
}

TEST(PowerLoss, leavesAnExportedFileWholeOrAsItWas) {
  for (const auto& [file, format] :
       {std::pair("x.bag", RecordingFormat::Rosbag), std::pair("x.mcap", RecordingFormat::Mcap)}) {
    expectNothingLost([name = file, as = format](const std::string& folder, Witness& witness) {
      scenes::exportTo(name, as, folder, witness);
    });
  }
}

TEST(PowerLoss, leavesAStoreThatIsRepairedOrTheOldOne) { expectNothingLost(scenes::repair); }

}  // namespace
}  // namespace afterglow::replay::power_loss_test

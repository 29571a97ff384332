// What people bring along as a recording: other files under its name, defective definitions, the
// stamp 0. The kinds are those of ../reports.md.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/mcap_writer.hpp"
#include "replay/messages/definitions.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::foreign_files_test {
namespace {

using namespace afterglow::test;
using Texts = std::vector<std::string>;

struct ForeignFile : testing::Test {
  /// What the import says of a file with these first bytes, without its name.
  std::string errorOf(const std::string& bytes) {
    writeFile(path, bytes);
    return errorOfFile();
  }
  std::string errorOfFile() {
    try {
      importBag(path, *openMemoryStore());
    } catch (const BagError& error) {
      const std::string said = error.what();
      EXPECT_EQ(said.substr(0, path.size() + 2), path + ": ");
      return said.substr(std::min(said.size(), path.size() + 2));
    }
    return "";
  }
  void writeMcap(const McapSchema& schema, const std::string& encoding, const std::string& md5,
                 const Bytes& message, std::uint64_t stamp = 5) {
    McapWriter writer(path, path, encoding == "cdr" ? "ros2" : "ros1", Packing::None);
    McapChannel channel{writer.addSchema(schema), "/a", encoding, {}};
    if (!md5.empty()) channel.metadata["md5sum"] = md5;
    writer.write(writer.addChannel(channel), 0, stamp, message);
    writer.close();
  }

  TempFolder folder;
  std::string path = folder.path("given.bag");
};

TEST_F(ForeignFile, isNamedByItsFirstBytes) {
  const std::string page = "is a web page, not the file that its link leads to; get the file itself";
  EXPECT_EQ(errorOf("<!DOCTYPE html>\n<html><body>GitHub</body></html>\n"), page);
  EXPECT_EQ(errorOf("\xef\xbb\xbf\r\n  <HTML lang=\"en\">"), page);
  EXPECT_EQ(errorOf("<?xml version=\"1.0\"?><Error><Code>AccessDenied</Code></Error>"),
            "is XML, as a server answers that has not, or does not give, the file");
  EXPECT_EQ(errorOf("{\"message\": \"Not Found\"}"),
            "is JSON, as a server answers that has not, or does not give, the file");
  EXPECT_EQ(errorOf("version https://git-lfs.github.com/spec/v1\noid sha256:abc\nsize 12345\n"),
            "is a Git LFS pointer, not the file itself; 'git lfs pull' fetches that");
  EXPECT_EQ(errorOf("/annex/objects/SHA256E-s12345--abc.bag\n"),
            "is a git-annex pointer, not the file itself; 'git annex get' fetches that");
  EXPECT_EQ(errorOf("\x1f\x8b\x08 and so on"), "is compressed by gzip; 'gunzip' unpacks it");
  EXPECT_EQ(errorOf("BZh91AY&SY"), "is compressed by bzip2; 'bunzip2' unpacks it");
  EXPECT_EQ(errorOf("PK\x03\x04"), "is a ZIP archive; 'unzip' unpacks it");
  EXPECT_EQ(errorOf(std::string(257, 'x') + "ustar  "), "is a tar archive; 'tar -xf' unpacks it");
  EXPECT_EQ(errorOf(std::string(4096, '\0')),
            "holds zeros at its beginning, as after a lost power or a download that did not end");
  EXPECT_EQ(errorOf(""), "is empty");
}

TEST_F(ForeignFile, isNotTakenForABagOfAnotherVersionWhenItsLineEndsWereConverted) {
  const std::string converted =
      "went through a conversion of line ends (FTP's text mode, Git's autocrlf), which changed its "
      "bytes; get it again as binary";
  EXPECT_EQ(errorOf("#ROSBAG V2.0\r\nE\r\n"), converted);
  EXPECT_EQ(errorOf("\x89MCAP0\r\r\n and more"), converted) << "its line end is CRLF from the first";
  EXPECT_EQ(errorOf("\x89MCAP0\n and more"), converted) << "the other way";
}

TEST_F(ForeignFile, isNotWaitedForIfItIsAPipe) {
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  EXPECT_EQ(errorOfFile(), "is no regular file");
}

// ---------------------------------------------------------------------------------- definitions

/// Of ROS 1, as its MD5 says: rosmsg md5 geometry_msgs/PointStamped.
constexpr const char* kPointStamped = "c63aecb41bfdfd6b7e1fac37c7cbe7bf";

TEST_F(ForeignFile, isReadByTheKnownDefinitionWhereItsOwnIsDefective) {
  if (!installedDefinitions().find("geometry_msgs/PointStamped")) {
    GTEST_SKIP() << "no ROS definitions are installed here";
  }
  const Bytes point(16 + 24, 0);  // seq, stamp, an empty frame, three numbers
  const std::string broken[] = {"geometry_msgs/PointStamped",     // the type's name alone
                                "Header header\nPoint point\n",  // nested types are missing
                                "",
                                "# a comment alone\n"};
  for (const std::string& md5 : {std::string(), std::string(kPointStamped)}) {
    for (const std::string& text : broken) {
      writeMcap({"geometry_msgs/PointStamped", "ros1msg", text}, "ros1", md5, point);
      const auto store = openMemoryStore();
      const auto result = importBag(path, *store);
      EXPECT_EQ(result.messages, 1u) << text;
      ASSERT_EQ(result.remarks.size(), 1u) << text;
      EXPECT_EQ(result.remarks[0].find(path + ": /a (geometry_msgs/PointStamped) is read by the "
                                              "definition known here, as its own is defective: "),
                0u)
          << result.remarks[0];
      EXPECT_EQ(store->behavior(result.behavior.id)->remarks, result.remarks);
      const auto message = readAll(*store->messages(result.behavior, {})).front();
      EXPECT_EQ(store->channel(message.channel).md5, kPointStamped);
      EXPECT_EQ(message.header_stamp, Stamp{0}) << "its fields are read";
    }
  }
}

TEST_F(ForeignFile, ofRos2IsReadByTheKnownDefinitionToo) {
  if (!installedDefinitions().find("geometry_msgs/PointStamped")) {
    GTEST_SKIP() << "no ROS definitions are installed here";
  }
  // CDR, little endian: stamp, the frame "" with its zero, 3 bytes to align, three numbers.
  Bytes point(4 + 8 + 4 + 1 + 3 + 24, 0);
  point[1] = 1;
  point[12] = 1;
  for (const char* text : {"geometry_msgs/msg/PointStamped", "std_msgs/Header header\nPoint point\n", ""}) {
    writeMcap({"geometry_msgs/msg/PointStamped", "ros2msg", text}, "cdr", "", point);
    const auto store = openMemoryStore();
    const auto result = importBag(path, *store);
    EXPECT_EQ(result.messages, 1u) << text;
    ASSERT_EQ(result.remarks.size(), 1u) << text;
    EXPECT_NE(result.remarks[0].find("as its own is defective: "), std::string::npos);
    const auto message = readAll(*store->messages(result.behavior, {})).front();
    EXPECT_EQ(store->channel(message.channel).md5, kPointStamped);
  }
}

TEST_F(ForeignFile, keepsItsDefinitionWhereTheKnownTypeIsAnother) {
  const std::string other_md5(32, 'a');
  writeMcap({"std_msgs/String", "ros1msg", "a/B c\n"}, "ros1", other_md5, stringBytes("x"));
  const auto store = openMemoryStore();
  const auto result = importBag(path, *store);
  const auto message = readAll(*store->messages(result.behavior, {})).front();
  EXPECT_EQ(store->channel(message.channel).md5, other_md5);
  EXPECT_EQ(store->channel(message.channel).definition, "a/B c\n");
  EXPECT_TRUE(result.remarks.empty());
}

// --------------------------------------------------------------------------------------- stamp 0

/// One rule: 0 is a stamp like others, kept on every way in and out. A rosbag alone cannot hold it
/// (ros::TIME_MIN is 1 ns): there it is 1 ns, and that is counted.
TEST_F(ForeignFile, keepsTheStampZeroOnEveryWay) {
  writeMcap({"std_msgs/String", "ros1msg", "string data\n"}, "ros1", "", stringBytes("zero"), 0);
  const auto store = openMemoryStore();
  const auto first = importBag(path, *store);
  EXPECT_EQ(readAll(*store->messages(first.behavior, {})).front().received, Stamp{0});
  BagExport mcap;
  mcap.format = RecordingFormat::Mcap;
  EXPECT_EQ(exportBags(*store, {first.behavior}, {}, path, mcap).unstamped, 0u);
  const auto second = importBag(path, *store);
  EXPECT_EQ(readAll(*store->messages(second.behavior, {})).front().received, Stamp{0});
}

}  // namespace
}  // namespace afterglow::replay::foreign_files_test

// MCAP's conformance variants, generated from the specification (mcap.dev/spec): each set of records
// with each combination of the features that it can have. They are named as in MCAP's own suite:
// OneMessage-ch-chx-mx-pad-rch-rsh-st-sum.
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <functional>
#include <set>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/mcap_reader.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::mcap_conformance_test {
namespace {

using namespace afterglow::test;
using Features = std::set<std::string>;

/// The table of features: its short name, the contents that can have it (by what they hold), and
/// whether it puts something into the summary, which alone can have summary offsets.
struct Feature {
  const char* name;
  const char* needs;
  bool is_in_summary;
};
constexpr Feature kFeatures[] = {{"ax", "attachment", true},   // attachment index
                                 {"ch", "channel", false},     // chunks
                                 {"chx", "ch", true},          // chunk index
                                 {"mdx", "metadata", true},    // metadata index
                                 {"mx", "ch", false},          // message index
                                 {"pad", "", false},           // bytes behind the known fields
                                 {"rch", "channel", true},     // channels repeated in the summary
                                 {"rsh", "schema", true},      // schemas repeated in the summary
                                 {"st", "", true},             // statistics
                                 {"sum", "", false}};          // summary offsets

struct Contents {
  const char* name;
  Features holds;
  int messages;
};
const Contents kContents[] = {{"NoData", {}, 0},
                              {"OneAttachment", {"attachment"}, 0},
                              {"OneMetadata", {"metadata"}, 0},
                              {"OneMessage", {"channel", "schema"}, 1},
                              {"OneSchemalessMessage", {"channel"}, 1},
                              {"TenMessages", {"channel", "schema"}, 10}};

struct Variant {
  const Contents& contents;
  Features features;
  std::string name() const {
    std::string all = contents.name;
    for (const std::string& feature : features) all += "-" + feature;
    return all;
  }
};

bool isPossible(const Variant& variant) {
  bool has_summary = false;
  for (const Feature& feature : kFeatures) {
    if (variant.features.count(feature.name) == 0) continue;
    const std::string needs = feature.needs;
    const bool is_met = needs.empty() || variant.contents.holds.count(needs) != 0 ||
                        variant.features.count(needs) != 0;
    if (!is_met) return false;
    has_summary = has_summary || feature.is_in_summary;
  }
  return has_summary || variant.features.count("sum") == 0;
}

std::vector<Variant> allVariants() {
  std::vector<Variant> variants;
  for (const Contents& contents : kContents) {
    for (unsigned set = 0; set < 1u << std::size(kFeatures); ++set) {
      Variant variant{contents, {}};
      for (std::size_t i = 0; i < std::size(kFeatures); ++i) {
        if ((set >> i & 1u) != 0) variant.features.insert(kFeatures[i].name);
      }
      if (isPossible(variant)) variants.push_back(variant);
    }
  }
  return variants;
}

// ------------------------------------------------------------------------------------ their bytes

template <typename T>
std::string number(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}
std::string u16(std::uint64_t value) { return number(static_cast<std::uint16_t>(value)); }
std::string u32(std::uint64_t value) { return number(static_cast<std::uint32_t>(value)); }
std::string u64(std::uint64_t value) { return number(value); }
std::string text(const std::string& value) { return u32(value.size()) + value; }
std::string crc(const std::string& bytes) {
  return u32(crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

class Maker {
 public:
  explicit Maker(const Variant& variant) : variant_(variant) {}

  std::string make() {
    file_ = std::string(kMcapMagic) + record(0x01, text("") + text(""));
    putMessages();
    putOthers();
    file_ += fixed(0x0f, u32(0));
    const std::string summary = makeSummary(), offsets = has("sum") ? makeOffsets() : "";
    const std::uint64_t summary_at = summary.empty() ? 0 : file_.size();
    const std::uint64_t offsets_at = offsets.empty() ? 0 : file_.size() + summary.size();
    const std::string footer =
        std::string(1, '\x02') + u64(20) + u64(summary_at) + u64(offsets_at);
    file_ += summary + offsets + footer + crc(summary + offsets + footer);
    return file_ + std::string(kMcapMagic);
  }

 private:
  struct Group {
    int kind;
    std::string records;
  };

  bool has(const std::string& feature) const { return variant_.features.count(feature) != 0; }
  bool holds(const std::string& what) const { return variant_.contents.holds.count(what) != 0; }
  static std::string fixed(int kind, const std::string& content) {
    return std::string(1, static_cast<char>(kind)) + u64(content.size()) + content;
  }
  /// Records may be extended by fields that a reader does not know, but for messages, whose last
  /// field has no length, the footer and the end of the data, whose places are counted.
  std::string record(int kind, const std::string& content) const {
    return fixed(kind, content + (has("pad") && kind != 0x05 ? "\x01\x02\x03" : ""));
  }
  std::string schema() const {
    return holds("schema") ? record(0x03, u16(1) + text("std_msgs/String") + text("ros1msg") +
                                              text("string data\n"))
                           : "";
  }
  std::string channel() const {
    const std::string metadata = text("foo") + text("bar");
    return record(0x04, u16(1) + u16(holds("schema") ? 1 : 0) + text("/example") + text("ros1") +
                            text(metadata));
  }

  void putMessages() {
    const auto count = static_cast<std::uint64_t>(variant_.contents.messages);
    if (count == 0) return;
    std::string records = schema() + channel(), index;
    for (std::uint64_t i = 0; i < count; ++i) {
      index += u64(i + 1) + u64(records.size());
      records += record(0x05, u16(1) + u32(i) + u64(i + 1) + u64(i) + text(std::to_string(i)));
    }
    if (!has("ch")) {
      file_ += records;
      return;
    }
    const std::uint64_t chunk_at = file_.size();
    file_ += record(0x06, u64(1) + u64(count) + u64(records.size()) + crc(records) + text("") +
                              u64(records.size()) + records);
    const std::uint64_t index_at = file_.size();
    if (has("mx")) file_ += record(0x07, u16(1) + text(index));
    const std::string places = has("mx") ? u16(1) + u64(index_at) : "";
    chunk_index_ = record(0x08, u64(1) + u64(count) + u64(chunk_at) + u64(index_at - chunk_at) +
                                    text(places) + u64(file_.size() - index_at) + text("") +
                                    u64(records.size()) + u64(records.size()));
  }

  void putOthers() {
    const std::uint64_t at = file_.size();
    if (holds("attachment")) {
      const std::string content =
          u64(2) + u64(1) + text("myFile") + text("application/octet-stream") + u64(3) + "\x01\x02\x03";
      file_ += fixed(0x09, content + crc(content));
      attachment_index_ =
          record(0x0a, u64(at) + u64(file_.size() - at) + u64(2) + u64(1) + u64(3) +
                           text("myFile") + text("application/octet-stream"));
    }
    if (holds("metadata")) {
      file_ += record(0x0c, text("myMetadata") + text(text("foo") + text("bar")));
      metadata_index_ = record(0x0d, u64(at) + u64(file_.size() - at) + text("myMetadata"));
    }
  }

  std::string statistics() const {
    const auto count = static_cast<std::uint64_t>(variant_.contents.messages);
    const std::string counts = count > 0 ? u16(1) + u64(count) : "";
    return record(0x0b, u64(count) + u16(holds("schema")) + u32(holds("channel")) +
                            u32(holds("attachment")) + u32(holds("metadata")) + u32(has("ch")) +
                            u64(count > 0 ? 1 : 0) + u64(count) + text(counts));
  }

  std::string makeSummary() {
    const auto add = [&](const char* feature, int kind, const std::string& records) {
      if (has(feature) && !records.empty()) groups_.push_back({kind, records});
    };
    add("rsh", 0x03, schema());
    add("rch", 0x04, holds("channel") ? channel() : "");
    add("st", 0x0b, statistics());
    add("mdx", 0x0d, metadata_index_);
    add("ax", 0x0a, attachment_index_);
    add("chx", 0x08, chunk_index_);
    std::string summary;
    for (const Group& group : groups_) summary += group.records;
    return summary;
  }
  std::string makeOffsets() const {
    std::string offsets;
    std::uint64_t at = file_.size();
    for (const Group& group : groups_) {
      offsets += record(0x0e, std::string(1, static_cast<char>(group.kind)) + u64(at) +
                                  u64(group.records.size()));
      at += group.records.size();
    }
    return offsets;
  }

  const Variant& variant_;
  std::string file_, chunk_index_, attachment_index_, metadata_index_;
  std::vector<Group> groups_;
};

// ---------------------------------------------------------------------------------------- the tests

TEST(McapConformance, hasAsManyVariantsAsTheSuiteOfMcapItself) {
  EXPECT_EQ(allVariants().size(), 416u);
  std::set<std::string> names;
  for (const Variant& variant : allVariants()) names.insert(variant.name());
  EXPECT_EQ(names.size(), 416u);
  EXPECT_EQ(names.count("OneMessage-ch-chx-mx-pad-rch-rsh-st-sum"), 1u);
  EXPECT_EQ(names.count("NoData-sum"), 0u) << "there is nothing that it could point to";
}

TEST(McapConformance, givesEveryMessageOfEveryVariant) {
  const TempFolder folder;
  const std::string path = folder.path("variant.mcap");
  for (const Variant& variant : allVariants()) {
    SCOPED_TRACE(variant.name());
    writeFile(path, Maker(variant).make());
    McapReader reader(path);
    int count = 0;
    while (const auto message = reader.next()) {
      const std::string expected = text(std::to_string(count++));
      EXPECT_EQ(message->log_time, static_cast<std::uint64_t>(count));
      EXPECT_EQ(std::string(message->data, message->data + message->size), expected);
      const McapDefinitions& known = reader.definitions();
      EXPECT_EQ(known.channel(message->channel).topic, "/example");
      EXPECT_EQ(known.schema(known.channel(message->channel)) != nullptr,
                variant.contents.holds.count("schema") != 0);
    }
    EXPECT_EQ(count, variant.contents.messages);
    EXPECT_EQ(reader.whyIncomplete(), "");
  }
}

TEST(McapConformance, importsEveryVariantOrSaysTrulyWhyNot) {
  const TempFolder folder;
  const std::string path = folder.path("variant.mcap");
  for (const Variant& variant : allVariants()) {
    SCOPED_TRACE(variant.name());
    writeFile(path, Maker(variant).make());
    const auto store = openMemoryStore();
    const auto expected = static_cast<std::uint64_t>(variant.contents.messages);
    const bool has_type = variant.contents.holds.count("schema") != 0;
    try {
      const auto result = importBag(path, *store);
      EXPECT_TRUE(has_type);
      EXPECT_EQ(result.messages, expected);
      EXPECT_EQ(result.behavior.outcome, "imported");
      EXPECT_TRUE(result.remarks.empty());
    } catch (const BagError& error) {
      EXPECT_FALSE(has_type);
      const std::string nothing = path + ": the bag holds no messages";
      EXPECT_EQ(error.what(), expected == 0
                                  ? nothing
                                  : nothing + " that can be read; " + path +
                                        ": left out 1 messages of /example (no type) as its "
                                        "channel names no schema, so that its type is unknown");
    }
  }
}

}  // namespace
}  // namespace afterglow::replay::mcap_conformance_test

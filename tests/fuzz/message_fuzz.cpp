// Definitions and messages from nowhere: neither may crash, hang, or make us take memory that they
// do not pay for; and what is understood must come out as it went in.
// An input is a text's length (2 bytes, little endian), the text, and a message. The text is the
// message's type, a line break, and its definition.
// More seeds: tests/fuzz/make_message_seeds.py FOLDER.
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "replay/messages/document.hpp"
#include "replay/messages/field_edit.hpp"
#include "replay/plan/rewrite.hpp"
#include "replay/ros2/cdr_conversion.hpp"
#include "replay/ros2/type_description.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/document_fields.hpp"

namespace afterglow::fuzz::message_fuzz {
namespace {

using namespace replay;

void require(bool condition) {
  if (!condition) std::abort();
}

void readMessage(const Schema& schema, const Bytes& bytes) {
  const FieldFinder finder(schema, test::timeFields(schema));
  try {
    const Value document = decode(schema, bytes);
    require(encode(schema, document) == bytes);
    toJson(document).dump();
    finder.find(bytes);  // whatever can be decoded can be searched
  } catch (const MessageError&) {
  }
  try {
    finder.find(bytes);
    headerStamp(schema, bytes);
  } catch (const MessageError&) {
  }
}

/// As ROS 2 serializes it, and as if these bytes were such a message.
void convertMessage(const Schema& schema, const Bytes& bytes) {
  try {
    const CdrConversion both(schema, schema);
    const Bytes ros1 = both.toRos1(bytes);
    require(both.toRos1(both.toRos2(ros1)) == ros1);
  } catch (const MessageError&) {
  }
  try {
    const CdrConversion both(schema, schema);
    const Bytes cdr = both.toRos2(bytes);
    require(both.toRos2(both.toRos1(cdr)) == cdr);
  } catch (const MessageError&) {
  }
}

void readDescription(const Bytes& bytes) {
  try {
    ros1Definition("a/msg/B", definitionIn(bytes));
  } catch (const MessageError&) {
  }
}

void rewriteMessage(const Channel& channel, const Schema& schema, Bytes bytes) {
  Rewriter rewriter([] { return "fresh"; });
  try {
    if (rewriter.rewrite(channel, {{2'000'000'000}, 1'000'000'000}, bytes).publish) {
      // It is still a message of the same type.
      FieldFinder(schema, test::timeFields(schema)).find(bytes);
    }
  } catch (const MessageError&) {
    return;
  }
}

}  // namespace

AFTERGLOW_FUZZ_TARGET(message) {
  if (size < 2) return;
  const std::size_t length = std::min<std::size_t>(data[0] | data[1] << 8, size - 2);
  const std::string text(data + 2, data + 2 + length);
  const std::size_t line = std::min(text.find('\n'), text.size());
  const std::string type = text.substr(0, line);
  const std::string definition = text.substr(std::min(line + 1, text.size()));
  const Bytes bytes(data + 2 + length, data + size);
  readDescription(bytes);
  try {
    const Schema schema = Schema::parse(type, definition);
    readMessage(schema, bytes);
    convertMessage(schema, bytes);
    rewriteMessage({"/topic", type, "", definition, false, ""}, schema, bytes);
  } catch (const MessageError&) {
    // The right answer to most inputs.
  }
}

}  // namespace afterglow::fuzz::message_fuzz

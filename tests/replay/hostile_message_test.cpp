// Messages and counts that lie must be refused before memory is taken for them. This program counts
// what it allocates.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "replay/messages/document.hpp"
#include "replay/messages/field_edit.hpp"
#include "tests/support/message_definitions.hpp"

namespace {
std::atomic<std::size_t> largest_allocation{0};
std::atomic<std::size_t> all_allocations{0};
}  // namespace

// Not inlined, or the compiler takes malloc and delete for a pair that do not match.
[[gnu::noinline]] void* operator new(std::size_t size) {
  std::size_t largest = largest_allocation;
  while (size > largest && !largest_allocation.compare_exchange_weak(largest, size)) {
  }
  all_allocations += size;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
// A sanitizer has one of its own otherwise, which wants its own delete.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace afterglow::replay::hostile_message_test {
namespace {

struct Spent {
  bool refused = false;
  std::string why;
  std::size_t largest = 0, all = 0;
};

template <typename F>
Spent spend(F&& f) {
  Spent spent;
  largest_allocation = all_allocations = 0;
  try {
    f();
  } catch (const MessageError& error) {
    spent.refused = true;
    spent.largest = largest_allocation;
    spent.all = all_allocations;
    spent.why = error.what();
    return spent;
  }
  spent.largest = largest_allocation;
  spent.all = all_allocations;
  return spent;
}

/// A count, and behind it as many zero bytes as to make `size`.
Bytes counting(std::uint32_t count, std::size_t size) {
  Bytes bytes(size);
  for (int i = 0; i < 4; ++i) bytes[i] = static_cast<std::uint8_t>(count >> 8 * i);
  return bytes;
}

constexpr std::size_t kLittle = 4096;

TEST(HostileMessage, isRefusedForACountBeforeMemoryIsTaken) {
  for (const std::string type :
       {"uint8[]", "float64[]", "bool[]", "string[]", "time[]", "duration[]", "P[]", "string"}) {
    const Schema schema = Schema::parse("a/B", test::withTypes(type + " x\n", "a/P", test::kPoint));
    for (const std::uint32_t count : {0xFFFFFFFFu, 0x7FFFFFFFu, 0x20000001u, 9u}) {
      const Bytes bytes = counting(count, 12);
      const Spent reading = spend([&] { decode(schema, bytes); });
      EXPECT_TRUE(reading.refused) << type;
      EXPECT_LT(reading.all, kLittle) << type;
      const FieldPath path = FieldPath::parse(type == "string" ? "x"
                                              : type == "P[]"  ? "x[].x"
                                                               : "x[]");
      const Spent finding = spend([&] { findField(schema, bytes, path); });
      EXPECT_TRUE(finding.refused) << type;
      EXPECT_LT(finding.all, kLittle) << type;
    }
  }
}

TEST(HostileMessage, saysWhatTheCountWasAndWhere) {
  const Schema schema = Schema::parse("a/B", "int64 first\nfloat64[] x\n");
  Bytes bytes(20);
  for (int i = 8; i < 12; ++i) bytes[i] = 0xFF;
  EXPECT_EQ(
      spend([&] { decode(schema, bytes); }).why,
      "a/B, field x[0], at byte 12: counts 4294967295 elements of at least 8 bytes; 8 are left");
}

TEST(HostileMessage, isReadToItsLastByteAndNoFurther) {
  const Schema schema = Schema::parse("a/B", "string x\n");
  EXPECT_EQ(spend([&] { decode(schema, counting(1, 4)); }).why,
            "a/B, field x, at byte 4: needs 1 bytes; 0 are left");
}

TEST(HostileMessage, isRefusedForAFixedArrayThatCannotBeThere) {
  const Schema schema = Schema::parse("a/B", "float64[4294967295] x\n");
  const Spent spent = spend([&] { decode(schema, Bytes(12)); });
  EXPECT_TRUE(spent.refused);
  EXPECT_LT(spent.all, kLittle);
}

TEST(HostileMessage, isNotBelievedForElementsWithoutBytes) {
  const Schema schema = Schema::parse("a/B", test::withTypes("E[] x\n", "a/E", ""));
  const Spent spent = spend([&] { decode(schema, counting(0xFFFFFFFF, 4)); });
  EXPECT_TRUE(spent.refused);
  EXPECT_EQ(spent.why,
            "a/B, field x[65536], at byte 4: more than 65538 messages and arrays; so few bytes do "
            "not hold as many");
  EXPECT_LT(spent.all, 32u << 20);
  const Bytes three = counting(3, 4);
  EXPECT_EQ(encode(schema, decode(schema, three)), three);
  EXPECT_TRUE(findField(schema, counting(0xFFFFFFFF, 4), FieldPath::parse("x[]")).empty());
}

/// L1[64] of L2[64] of ... eight deep, of nothing: 64^8 elements.
std::string nothing(const std::string& innermost) {
  std::string definition = "L1[64] x\n";
  for (int i = 1; i < 8; ++i) {
    definition = test::withTypes(definition, "a/L" + std::to_string(i),
                                 "L" + std::to_string(i + 1) + "[64] x\n");
  }
  return test::withTypes(definition, "a/L8", innermost);
}

/// Each of these took for good.
TEST(HostileMessage, ofAnyNumberOfNothingIsReadAtOnce) {
  for (const std::string& definition :
       {nothing(""), nothing("string[0] text\n"), nothing("E[2000] x\n===\nMSG: a/E\n"),
        test::withTypes("E[4000000000] x\n", "a/E", "string[0] text\n"),
        test::withTypes("E[] x\n", "a/E", "F[4000000000] x\n", "a/F", "")}) {
    const Schema schema = Schema::parse("a/B", definition + "\n");
    const bool is_counted = definition[1] == '[' && definition[2] == ']';
    const Bytes bytes = is_counted ? counting(0xFFFFFFFF, 4) : Bytes();
    EXPECT_TRUE(spend([&] { decode(schema, bytes); }).refused);
    EXPECT_TRUE(fits(schema, bytes));
    EXPECT_TRUE(findField(schema, bytes, FieldPath::parse("x[]")).empty());
  }
}

TEST(HostileMessage, paysWithItsBytesForWhatIsLookedAt) {
  // A million elements of four bytes with as many fields of nothing as there may be.
  std::string fields = "string text\n";
  for (int i = 0; i < 62; ++i) fields += "uint8[0] x" + std::to_string(i) + "\n";
  const Schema schema = Schema::parse("a/B", test::withTypes("S[] x\n", "a/S", fields));
  const Bytes bytes = counting(1'000'000, 4'000'004);
  EXPECT_TRUE(spend([&] { decode(schema, bytes); }).refused) << "62 million arrays";
  EXPECT_TRUE(fits(schema, bytes));
}

TEST(HostileMessage, isBelievedStepByStepWhenElementsGrowInMemory) {
  // A million elements of at least 4 bytes could be there, but the first of them is cut off.
  const Schema schema = Schema::parse("a/B", test::withTypes("S[] x\n", "a/S", "string text\n"));
  Bytes bytes = counting(1'000'000, 4'000'004);
  for (int i = 4; i < 8; ++i) bytes[i] = 0xFF;
  const Spent spent = spend([&] { decode(schema, bytes); });
  EXPECT_TRUE(spent.refused);
  EXPECT_LT(spent.all, 128u << 10);
}

}  // namespace
}  // namespace afterglow::replay::hostile_message_test

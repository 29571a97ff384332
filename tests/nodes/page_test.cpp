// How data becomes a page: what makePage() promises of the templates' names.
#include "nodes/pages/page.hpp"

#include <gtest/gtest.h>
#include <kainjow/mustache.hpp>

#include <stdexcept>

#include "tests/support/markup.hpp"

namespace afterglow::nodes::page_test {
namespace {

std::string rendered(const std::string& markup, const PageData& data) {
  PageContext context(data);
  kainjow::mustache::mustache page(markup);
  page.set_custom_escape(escaped);
  return page.render(context);
}

TEST(Page, writesNumbersAsTheTemplateSays) {
  const PageData data = {{"m", 0.01234}, {"count", 3}, {"late", -0.0001}, {"unsure", nullptr}};
  EXPECT_EQ(rendered("{{m:.2f}} {{m:100*.1f}} {{m:1000*.1f mm}} {{count}} {{late:.2f}}", data),
            "0.01 1.2 12.3 mm 3 0.00");
  EXPECT_EQ(rendered("{{m:two}} {{m:100*two cm}} {{m:.1f°}}", data), "0.012 1.2 cm 0.0°");
  EXPECT_EQ(rendered("{{m}} {{count:02.0f}}", data), "0.01234 03");
  EXPECT_EQ(rendered("{{unsure:.1f s|-}} {{absent|–}} {{m:.1f|-}}", data), "- – 0.0");
}

TEST(Page, leavesOutWhatIsNotThere) {
  const PageData data = {{"no", nullptr}, {"empty", ""}, {"none", PageData::array()},
                         {"zero", 0},     {"some", {{"deep", "yes"}}}};
  EXPECT_EQ(rendered("{{#no}}a{{/no}}{{#empty}}b{{/empty}}{{#none}}c{{/none}}{{#x.y}}d{{/x.y}}",
                     data),
            "");
  EXPECT_EQ(rendered("{{^no}}a{{/no}}{{^empty}}b{{/empty}}{{^none}}c{{/none}}", data), "abc");
  EXPECT_EQ(rendered("{{#zero}}{{zero}}{{/zero}}{{#zero:any}}any{{/zero:any}}", data), "0");
  EXPECT_EQ(rendered("{{#some:any}}{{some.deep}}{{/some:any}} {{some.shallow|-}}", data), "yes -");
}

TEST(Page, goesThroughListsAndObjectsInOrder) {
  const PageData data = {{"unit", "s"},
                         {"rows", {{{"at", 1}}, {{"at", 2}, {"unit", "h"}}}},
                         {"words", {"a", "b"}},
                         {"topics", {{"/b", {{"count", 2}}}, {"/a", {{"count", 1}}}}},
                         {"versions", {{"one", "1.0"}}}};
  EXPECT_EQ(rendered("{{#rows}}{{at}}{{unit}} {{/rows}}", data), "1s 2h ");
  EXPECT_EQ(rendered("{{#words}}<{{.}}>{{/words}}", data), "<a><b>");
  EXPECT_EQ(rendered("{{#topics:each}}{{key}} {{count}} {{/topics:each}}", data), "/b 2 /a 1 ");
  EXPECT_EQ(rendered("{{#versions:each}}{{key}} {{value}}{{/versions:each}}", data), "one 1.0");
}

TEST(Page, escapesWhatDataHolds) {
  EXPECT_EQ(rendered("{{x}}", {{"x", "<a b=\"c\"> & \x01\xFF\n"}}),
            "&lt;a b=&quot;c&quot;&gt; &amp; \xEF\xBF\xBD\xEF\xBF\xBD\n");
}

TEST(Page, namesATemplateThatIsNotThere) {
  EXPECT_THROW(makePage("nowhere.html", {}), std::logic_error);
  EXPECT_THROW(rendered("{{> nowhere.html}}", {}), std::logic_error);
}

TEST(Page, hasPartsThatStandAlone) {
  PageData data = notice("Stopped: <why>", {{"", "a"}, {"b", "c"}}, true);
  EXPECT_EQ(test::markupProblem("\n" + rendered("{{> notice.html}}", data)), "");
  EXPECT_NE(rendered("{{> notice.html}}", data).find("<li>a</li><li><strong>b</strong>: c</li>"),
            std::string::npos);
  data = {{"facts", {{{"name", "Took"}, {"value", "2 s"}, {"remark", ""}}}}};
  EXPECT_NE(rendered("{{> facts.html}}", data).find("<dt>Took</dt><dd>2 s</dd>"),
            std::string::npos);
}

}  // namespace
}  // namespace afterglow::nodes::page_test

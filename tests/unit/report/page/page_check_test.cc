#include "report/page/page_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "report/page/page.h"

namespace evalbus::report::page_check_test {

using testing::Optional;

PageContent Content(const std::string& rate, const std::string& note, const std::string& url) {
  const std::string html = Page("noisy", "1.0 (abc)", {{"page", "report"}}, [&](Markup* html) {
    html->Element("h2", {}, "Success");
    html->Element("p", {{"class", "note"}, {kUnchecked, ""}}, note);
    html->Element("table", {}, [&] {
      html->Element("tr", {}, [&] {
        html->Element("th", {{"scope", "row"}}, "rate");
        html->Element("td", {}, [&] {
          html->Open(url.empty() ? "span" : "a", {{"class", "good"}, {"title", "episode 3"}});
          if (!url.empty()) html->Attribute("href", url);
          html->Text(rate);
          html->Close();
        });
      });
    });
    html->Empty("circle", {{"cx", rate.substr(0, 2)}});
  });
  return ReadPage(html, "page.html");
}

TEST(PageCheck, NamesTheFirstTextThatDiffers) {
  const PageContent page = Content("44 %", "", "");
  EXPECT_EQ(page.made_by, "1.0 (abc)");
  EXPECT_EQ(page.source["page"], "report");
  EXPECT_EQ(FirstDifference(page, page), std::nullopt);
  EXPECT_THAT(FirstDifference(page, Content("54 %", "", "")),
              Optional(std::string("'44 %' under 'Success, rate', recomputed '54 %'")));
  PageContent shorter = page;
  shorter.items.pop_back();
  EXPECT_THAT(FirstDifference(shorter, page),
              Optional(std::string("nothing under 'Success, rate', recomputed 'cx=\"44\"'")));
}

TEST(PageCheck, IgnoresLinksAndWhatIsNoResult) {
  EXPECT_EQ(FirstDifference(Content("44 %", "one", ""), Content("44 %", "two", "#view:run=0,episode=3")),
            std::nullopt);
}

TEST(PageCheck, OtherPagesAreNotOurs) {
  EXPECT_EQ(ReadPage("<html><body><p>1</p></body></html>", "p").made_by, "");
  EXPECT_THROW(ReadPage("<html><body><p>1</body></html>", "p"), InputError);
}

}  // namespace evalbus::report::page_check_test

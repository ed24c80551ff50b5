#include "bus/conflict_detector.h"

#include <gtest/gtest.h>

#include <array>

namespace evalbus::conflict_detector_test {

using Answer = ConflictDetector::Answer;

constexpr std::array<uint8_t, 3> kOurs = {1, 2, 3}, kTheirs = {1, 2, 4};

TEST(ConflictDetector, DistinguishesRepeatedAndConflictingMessages) {
  ConflictDetector detector;
  EXPECT_EQ(detector.Check("A", 7, kOurs), Answer::kNew);
  EXPECT_EQ(detector.Check("A", 7, kOurs), Answer::kRepeated);
  EXPECT_EQ(detector.conflict(), "");
  EXPECT_EQ(detector.Check("A", 7, kTheirs), Answer::kConflicting);
  EXPECT_EQ(detector.Check("A", 7, kOurs), Answer::kRepeated);
  EXPECT_EQ(detector.conflict(),
            "two different messages on A for tick 7: is a second publisher on this bus?");
}

TEST(ConflictDetector, KeepsTicksAndChannelsApartInAnyOrder) {
  ConflictDetector detector;
  EXPECT_EQ(detector.Check("A", 5000, kOurs), Answer::kNew);
  EXPECT_EQ(detector.Check("A", 0, kTheirs), Answer::kNew);
  EXPECT_EQ(detector.Check("B", 0, kOurs), Answer::kNew);
  EXPECT_EQ(detector.Check("A", 4999, kOurs), Answer::kNew);
  EXPECT_EQ(detector.Check("A", 5000, kTheirs), Answer::kConflicting);
  EXPECT_EQ(detector.Check("A", 0, kOurs), Answer::kConflicting);
  // Later conflicts do not replace the first one in the report.
  EXPECT_NE(detector.conflict().find("for tick 5000"), std::string::npos);
}

TEST(ConflictDetector, AnEpisodeStartsWithoutMemory) {
  ConflictDetector detector;
  detector.Check("A", 0, kOurs);
  detector.Check("A", 0, kTheirs);
  detector.Start();
  EXPECT_EQ(detector.conflict(), "");
  EXPECT_EQ(detector.Check("A", 0, kTheirs), Answer::kNew);
}

TEST(ConflictDetector, AMessageOfOtherLengthIsAnotherMessage) {
  ConflictDetector detector;
  detector.Check("A", 0, kOurs);
  EXPECT_EQ(detector.Check("A", 0, std::span(kOurs).first(2)), Answer::kConflicting);
}

}  // namespace evalbus::conflict_detector_test

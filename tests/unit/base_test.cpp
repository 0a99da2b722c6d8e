#include <gtest/gtest.h>

#include <atomic>
#include <numbers>
#include <numeric>

#include "toile/base/fields.h"
#include "toile/base/hash.h"
#include "toile/base/parallel.h"
#include "toile/base/rng.h"
#include "toile/base/text.h"
#include "toile/base/units.h"

using namespace toile;

namespace {

TEST(units, customary_quantities_become_si) {
  const struct {
    const char* text;
    const char* unit;
    double si;
  } rows[] = {
      {"8 mm", "m", 0.008},
      {"8mm", "m", 0.008},
      {"1.5e-2 m", "m", 0.015},
      {"-3 cm", "m", -0.03},
      {"30 deg", "rad", std::numbers::pi / 6},
      {"140 g/m2", "kg/m2", 0.14},
      {"14 mg/cm2", "kg/m2", 0.14},
      {"4.1 oz/yd2", "kg/m2", 4.1 * 0.028349523125 / (0.9144 * 0.9144)},
      {"3 %", "1", 0.03},
      {"500 gf/cm", "N/m", 490.3325},
      // KES-F conversions as they stand in docs/mechanics.md
      {"0.7 gf*cm2/cm", "N*m2/m", 0.7 * 98.0665e-6},
      {"0.5 gf/cm/deg", "N/m/rad", 0.5 * 0.980665 / 0.01745329251994329577},
      {"1 gf/(cm)", "N/m", -1},
      {"0", "m", 0},
      {"9.81 m/s^2", "m/s2", 9.81},
  };
  for (const auto& row : rows) {
    const auto value = parse_quantity(row.text, row.unit);
    if (row.si == -1) {
      EXPECT_FALSE(value) << row.text;
      continue;
    }
    ASSERT_TRUE(value) << row.text << ": " << to_string(value.issues().front());
    EXPECT_NEAR(*value, row.si, 1e-12 * std::max(1.0, std::abs(row.si))) << row.text;
  }
}

TEST(units, nonsense_is_refused) {
  for (const char* text : {"", "mm", "8", "8 kg", "8 mmm", "8 m/", "8 m m", "nan m", "inf m", "1e999 m", "0x10 m", "8,5 mm"}) EXPECT_FALSE(parse_quantity(text, "m")) << text;
  EXPECT_TRUE(parse_quantity_si("8", "m"));
}

TEST(text, numbers_survive_the_round_trip) {
  Rng rng(7);
  for (int i = 0; i < 10000; ++i) {
    const double value = (rng.uniform() - 0.5) * std::pow(10.0, rng.uniform(-300, 300));
    EXPECT_EQ(parse_number(format_number(value)), value);
  }
}

TEST(text, suggestions_are_near_or_complete) {
  const std::vector<std::string> names{"front", "back", "sleeve"};
  EXPECT_EQ(suggestion("fornt", names), "did you mean 'front'?");
  EXPECT_EQ(suggestion("waistband", names), "known: front, back, sleeve");
}

TEST(hash, is_the_content_alone) {
  EXPECT_EQ(content_hash("abc"), content_hash(std::string("abc")));
  EXPECT_NE(content_hash("abc"), content_hash("abd"));
  EXPECT_EQ(content_hash("").size(), 32u);
}

TEST(parallel, sums_have_the_same_bits_at_any_thread_count) {
  std::vector<double> values(100003);
  Rng rng(3);
  for (double& value : values) value = rng.uniform(-1, 1) * std::pow(10.0, rng.uniform(-8, 8));
  const auto sum = [&] {
    return parallel_reduce(
        values.size(), 1000, 0.0, [&](std::size_t begin, std::size_t end) { return std::accumulate(values.begin() + static_cast<std::ptrdiff_t>(begin), values.begin() + static_cast<std::ptrdiff_t>(end), 0.0); },
        [](double a, double b) { return a + b; });
  };
  set_thread_count(1);
  const double one = sum();
  for (int threads : {2, 3, 5, 8}) {
    set_thread_count(threads);
    EXPECT_EQ(sum(), one);
  }
  set_thread_count(0);
}

TEST(parallel, visits_every_item_once) {
  for (int threads : {1, 2, 5}) {
    set_thread_count(threads);
    for (std::size_t n : {0u, 1u, 7u, 1000u, 1001u}) {
      std::vector<int> visits(n, 0);
      parallel_for(n, 10, [&](std::size_t i) { ++visits[i]; });
      EXPECT_TRUE(std::all_of(visits.begin(), visits.end(), [](int v) { return v == 1; }));
    }
  }
  set_thread_count(0);
}

TEST(parallel, exceptions_reach_the_caller) {
  for (int threads : {1, 5}) {
    set_thread_count(threads);
    EXPECT_THROW(parallel_for(1000, 10, [](std::size_t i) { if (i == 777) throw std::runtime_error("x"); }), std::runtime_error);
  }
  set_thread_count(0);
}

struct Inner {
  double length = 1;
  static void describe(auto& f) { f(&Inner::length, {.key = "length", .doc = "length", .unit = "m", .min = 0, .max = 2}); }
};
struct Outer {
  Inner inner;
  std::vector<Inner> list{{}, {3}};
  std::map<std::string, double> map{{"a", 1}, {"b", 9}};
  static void describe(auto& f) {
    f(&Outer::inner, {.key = "inner", .doc = "one"});
    f(&Outer::list, {.key = "list", .doc = "several"});
    f(&Outer::map, {.key = "map", .doc = "by name", .max = 5});
    f.check([](const Outer& o, Issues& issues) {
      if (o.list.size() > 1) issues.push_back({"too_many", {.item = "list"}, "too many", "fewer"});
    });
  }
};

TEST(fields, validation_reaches_nested_values_and_names_their_path) {
  const Issues issues = validate(Outer{});
  ASSERT_EQ(issues.size(), 3u);
  EXPECT_EQ(issues[0].place.item, "list[1].length");
  EXPECT_EQ(issues[1].place.item, "map.b");
  EXPECT_EQ(issues[2].place.item, "list");
}

TEST(fields, dotted_names_lead_into_records) {
  Outer outer;
  void* record = &outer;
  const Field* field = find_field(*record_type<Outer>(), "inner.length", &record);
  ASSERT_NE(field, nullptr);
  *static_cast<double*>(field->address(record)) = 0.5;
  EXPECT_EQ(outer.inner.length, 0.5);
  EXPECT_EQ(find_field(*record_type<Outer>(), "inner.width", nullptr), nullptr);
  EXPECT_EQ(find_field(*record_type<Outer>(), "list.length", nullptr), nullptr);
}

TEST(result, keeps_issues_and_refuses_to_hand_out_nothing) {
  const Result<int> failed = Issue{"code", {.file = "a.yaml", .line = 3, .column = 7, .item = "panel front"}, "it is wrong", "mend it"};
  EXPECT_FALSE(failed);
  EXPECT_EQ(to_string(failed.issues().front()), "a.yaml:3:7: panel front: it is wrong; mend it");
  EXPECT_THROW(failed.value(), std::logic_error);
  EXPECT_THROW(Result<int>(Issues{}), std::logic_error);
}

}  // namespace

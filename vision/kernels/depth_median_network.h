// Comparators of the 5x5 median. A window at a sample: wires are numbered row * 5 + column; each column is sorted
// downwards, and what a search left after removing every comparator the answer can do without puts the median on
// kMedianWire. Dense: sorted columns are merged by two and four, and four columns serve two windows. The proof is a
// test: a network that is right for all inputs of zeros and ones is right (Knuth, vol. 3, 5.3.4, Z).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace wasp::vision {

/// Afterwards wire `low` has the smaller of the two values and `high` the larger.
struct Comparator {
  std::uint8_t low, high;
};

/// Sorts five values, wires 0 ... 4.
inline constexpr std::array<Comparator, 9> kSortFive{
    {{0, 1}, {3, 4}, {2, 4}, {2, 3}, {1, 4}, {0, 3}, {0, 2}, {1, 3}, {1, 2}}};

/// Sorts four values, wires 0 ... 3.
inline constexpr std::array<Comparator, 5> kSortFour{{{0, 1}, {2, 3}, {0, 2}, {1, 3}, {1, 2}}};

/// Columns 0, 1 and columns 3, 4 of each row.
inline constexpr std::array<Comparator, 10> kOrderNeighbours{
    {{0, 1}, {3, 4}, {5, 6}, {8, 9}, {10, 11}, {13, 14}, {15, 16}, {18, 19}, {20, 21}, {23, 24}}};

/// The rest: 68 minima and maxima are read by somebody.
inline constexpr std::array<Comparator, 46> kMedianOfSortedColumns{
    {{2, 4},   {2, 3},   {1, 4},   {1, 3},   {0, 3},   {7, 9},   {5, 8},   {7, 8},   {6, 9},   {6, 8},
     {6, 7},   {12, 14}, {12, 13}, {11, 14}, {10, 13}, {20, 24}, {10, 12}, {11, 13}, {8, 20},  {11, 12},
     {17, 18}, {16, 19}, {15, 18}, {15, 17}, {16, 18}, {16, 17}, {20, 23}, {20, 22}, {21, 22}, {15, 7},
     {4, 12},  {9, 16},  {11, 4},  {20, 8},  {7, 3},   {4, 20},  {12, 8},  {17, 21}, {12, 20}, {3, 12},
     {13, 9},  {12, 20}, {12, 17}, {3, 12},  {20, 13}, {12, 20}}};
inline constexpr std::size_t kMedianWire = 20;

/// Dense: merges wires 0 ... 4 with wires 5 ... 9, each rising; the ranks come out on kMergedFives.
inline constexpr std::array<Comparator, 13> kMergeFives{
    {{2, 7}, {0, 5}, {4, 9}, {4, 7}, {4, 5}, {4, 2}, {1, 6}, {3, 8}, {1, 4}, {6, 3}, {6, 2}, {3, 5}, {8, 7}}};
inline constexpr std::array<std::uint8_t, 10> kMergedFives{0, 1, 4, 6, 2, 3, 5, 8, 7, 9};

/// Dense: of wires 0 ... 9 and 10 ... 19, each rising, the 8th to the 13th smallest, on kMiddle in this order:
/// the median of these twenty and any five others is among them. 36 minima and maxima are read by somebody.
inline constexpr std::array<Comparator, 25> kMiddleOfTens{
    {{6, 12}, {16, 2}, {16, 6}, {2, 12}, {8, 14}, {8, 0},  {4, 10}, {18, 10}, {18, 0},
     {0, 2},  {7, 13}, {17, 3}, {17, 7}, {3, 13}, {9, 15}, {9, 1},  {5, 11},  {19, 11},
     {19, 1}, {19, 7}, {18, 6}, {1, 3},  {19, 6}, {7, 0},  {1, 2}}};
inline constexpr std::array<std::uint8_t, 6> kMiddle{19, 6, 7, 0, 1, 2};

}  // namespace wasp::vision

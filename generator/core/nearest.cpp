// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/nearest.h"

#include <algorithm>

namespace brdfc::inline core {
namespace {

/// The Damerau-Levenshtein distance in its restricted form: no letter is edited more than once.
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

}  // namespace

std::string did_you_mean(const std::string& word, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t fewest = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& k : known) {
    // The difference in length is a lower bound of the distance. This test is cheap even if the word is as long as a
    // file.
    if (std::max(word.size(), k.size()) - std::min(word.size(), k.size()) >= fewest) continue;
    if (const std::size_t n = edits(word, k); n < fewest) fewest = n, nearest = k;
  }
  return nearest.empty() ? "" : "did you mean " + nearest + "? ";
}

}  // namespace brdfc::inline core

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/nearest.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/text.h"

namespace brdfc::inline core {
namespace {

/// Fewest letters of a word that is looked for inside of other words.
constexpr std::size_t kLeastPart = 4;

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
  std::vector<std::string> nearest;
  std::size_t fewest = std::max<std::size_t>(1, word.size() / 3);
  for (const std::string& k : known) {
    // The difference in length is a lower bound of the distance. This test is cheap even if the word is as long as a
    // file.
    if (std::max(word.size(), k.size()) - std::min(word.size(), k.size()) > fewest) continue;
    const std::size_t n = edits(word, k);
    if (n < fewest) nearest.clear();
    if (n <= fewest) fewest = n, nearest.push_back(k);
  }
  if (word.size() >= kLeastPart)
    for (const std::string& k : known)
      if (k.find(word) != std::string::npos && std::ranges::find(nearest, k) == nearest.end()) nearest.push_back(k);
  if (nearest.empty()) return "";
  const std::string last = nearest.back();
  nearest.pop_back();
  return fmt::format("did you mean {}{}{}? ", join(nearest, ", "), nearest.empty() ? "" : " or ", last);
}

}  // namespace brdfc::inline core

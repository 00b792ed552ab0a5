// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/inverted_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace docent::engine {

namespace {

constexpr std::uint32_t kCountBits = 4;
constexpr std::uint32_t kCountMask = (1u << kCountBits) - 1;
// Limit for the postings that one search reads. Words beyond it are skipped; they are the most frequent and
// carry the least information.
constexpr std::size_t kMaxPostings = 300'000;
// The number of candidates that are compared with all words.
constexpr std::size_t kFineCandidates = 256;

int LengthOf(const WordBag& bag) {
  int length = 0;
  for (const VisualWord& word : bag) length += word.count();
  return length;
}

}  // namespace

// Sums of the shared words by slot during one search.
struct InvertedFile::Scratch {
  std::vector<float> shared;
  std::vector<Slot> touched;
};

// The inverse document frequency of each word.
class InvertedFile::Weights {
 public:
  explicit Weights(const InvertedFile& file) : rarity_(file.lists_.size()) {
    const double keyframes = static_cast<double>(file.bags_.size() - file.free_.size());
    for (std::size_t word = 0; word < rarity_.size(); ++word) {
      // A word that no keyframe contains is weighted like a word of a single keyframe.
      rarity_[word] =
          static_cast<float>(std::log1p(std::max(1.0, keyframes) / static_cast<double>(std::max<std::size_t>(
                                                                       1, file.lists_[word].size()))));
    }
  }
  float operator[](std::size_t word) const { return rarity_[word]; }
  double SumOf(const WordBag& bag) const {
    double sum = 0;
    for (const VisualWord& word : bag) sum += word.count() * rarity_[word.leaf()];
    return sum;
  }
  // See Hit::score.
  double Compare(const WordBag& a, double sum_a, const WordBag& b) const {
    const double sum_b = SumOf(b);
    double shared = 0;
    for (auto p = a.begin(), q = b.begin(); p != a.end() && q != b.end();) {
      if (p->leaf() < q->leaf()) {
        ++p;
      } else if (q->leaf() < p->leaf()) {
        ++q;
      } else {
        shared += rarity_[p->leaf()] * std::min(p->count() / sum_a, q->count() / sum_b);
        ++p;
        ++q;
      }
    }
    return shared;
  }

 private:
  std::vector<float> rarity_;
};

class InvertedFile::ReadLock {
 public:
  explicit ReadLock(const InvertedFile& file) {
    const std::scoped_lock passing(file.writer_priority_mutex_);
    lock_ = std::shared_lock(file.mutex_);
  }

 private:
  std::shared_lock<std::shared_mutex> lock_;
};

InvertedFile::InvertedFile() : lists_(VocabularyTree::kLeaves) {}
InvertedFile::~InvertedFile() = default;

InvertedFile::Slot InvertedFile::Add(const WordBag& bag, Owner owner) {
  const std::scoped_lock closing(writer_priority_mutex_);
  const std::scoped_lock lock(mutex_);
  if (free_.empty()) {
    free_.push_back(static_cast<Slot>(bags_.size()));
    bags_.emplace_back();
    lengths_.push_back(0);
    owners_.emplace_back();
  }
  const Slot slot = free_.back();
  free_.pop_back();
  for (const VisualWord& word : bag)
    lists_[word.leaf()].push_back(slot << kCountBits | static_cast<std::uint32_t>(word.count() - 1));
  postings_ += bag.size();
  bags_[slot] = bag;
  lengths_[slot] = static_cast<std::uint16_t>(std::min(LengthOf(bag), 0xFFFF));
  owners_[slot] = owner;
  return slot;
}

void InvertedFile::Remove(Slot slot) {
  const std::scoped_lock closing(writer_priority_mutex_);
  const std::scoped_lock lock(mutex_);
  for (const VisualWord& word : bags_[slot]) {
    std::vector<std::uint32_t>& list = lists_[word.leaf()];
    const auto place = std::find(list.begin(), list.end(),
                                 slot << kCountBits | static_cast<std::uint32_t>(word.count() - 1));
    *place = list.back();
    list.pop_back();
  }
  postings_ -= bags_[slot].size();
  bags_[slot] = {};
  owners_[slot] = {};
  free_.push_back(slot);
}

std::size_t InvertedFile::size() const {
  const ReadLock lock(*this);
  return bags_.size() - free_.size();
}

std::size_t InvertedFile::postings() const {
  const ReadLock lock(*this);
  return postings_;
}

std::unique_ptr<InvertedFile::Scratch> InvertedFile::TakeScratch() const {
  const std::scoped_lock lock(scratch_mutex_);
  if (scratch_.empty()) return std::make_unique<Scratch>();
  auto scratch = std::move(scratch_.back());
  scratch_.pop_back();
  return scratch;
}

void InvertedFile::ReturnScratch(std::unique_ptr<Scratch> scratch) const {
  const std::scoped_lock lock(scratch_mutex_);
  scratch_.push_back(std::move(scratch));
}

std::vector<InvertedFile::Slot> InvertedFile::Shortlist(const WordBag& wanted, const Weights& weights,
                                                        std::size_t count, Cost* cost) const {
  std::vector<VisualWord> rarest_first(wanted.begin(), wanted.end());
  std::sort(rarest_first.begin(), rarest_first.end(), [&](const VisualWord& a, const VisualWord& b) {
    return std::pair(lists_[a.leaf()].size(), a.leaf()) < std::pair(lists_[b.leaf()].size(), b.leaf());
  });
  auto scratch = TakeScratch();
  scratch->shared.resize(bags_.size());
  float* const shared = scratch->shared.data();
  for (const VisualWord& word : rarest_first) {
    const std::vector<std::uint32_t>& list = lists_[word.leaf()];
    if (cost->postings + list.size() > kMaxPostings) break;
    ++cost->words;
    cost->postings += list.size();
    // What a posting adds to the sum, by its count.
    std::array<float, VisualWord::kMaxCount> adds;
    for (int i = 0; i < VisualWord::kMaxCount; ++i)
      adds[static_cast<std::size_t>(i)] =
          weights[word.leaf()] * static_cast<float>(std::min(word.count(), i + 1));
    for (const std::uint32_t posting : list) {
      const Slot slot = posting >> kCountBits;
      if (shared[slot] == 0) scratch->touched.push_back(slot);
      shared[slot] += adds[posting & kCountMask];
    }
  }
  // The sum is normalized, because long bags share more words by chance.
  const auto length = static_cast<float>(LengthOf(wanted));
  std::vector<std::pair<float, Slot>> ranked;
  ranked.reserve(scratch->touched.size());
  for (const Slot slot : scratch->touched) {
    ranked.emplace_back(-shared[slot] / (length + static_cast<float>(lengths_[slot])), slot);
    shared[slot] = 0;
  }
  scratch->touched.clear();
  ReturnScratch(std::move(scratch));
  if (ranked.size() > count) {
    std::nth_element(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(count), ranked.end());
    ranked.resize(count);
  }
  std::vector<Slot> slots;
  for (const auto& [score, slot] : ranked) slots.push_back(slot);
  return slots;
}

std::vector<InvertedFile::Hit> InvertedFile::Search(const WordBag& wanted, std::size_t count,
                                                    Cost* cost) const {
  Cost own;
  if (!cost) cost = &own;
  *cost = {};
  std::vector<Hit> hits;
  if (wanted.empty() || count == 0) return hits;
  const ReadLock lock(*this);
  const Weights weights(*this);
  const double sum = weights.SumOf(wanted);
  for (const Slot slot : Shortlist(wanted, weights, std::max(count, kFineCandidates), cost))
    hits.push_back({slot, owners_[slot], weights.Compare(wanted, sum, bags_[slot])});
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
    return a.score != b.score ? a.score > b.score : a.slot < b.slot;
  });
  if (hits.size() > count) hits.resize(count);
  return hits;
}

std::vector<double> InvertedFile::Scores(const WordBag& wanted, std::span<const Slot> slots) const {
  std::vector<double> scores(slots.size(), 0.0);
  if (wanted.empty()) return scores;
  const ReadLock lock(*this);
  const Weights weights(*this);
  const double sum = weights.SumOf(wanted);
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (slots[i] < bags_.size()) scores[i] = weights.Compare(wanted, sum, bags_[slots[i]]);
  }
  return scores;
}

}  // namespace docent::engine

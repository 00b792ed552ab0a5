// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <span>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/recognition/word_bag.h"

namespace docent::engine {

// An inverted file of visual words (Sivic and Zisserman 2003): the bag of words of each keyframe and, for
// each word, the list of keyframes that contain it. A search reads only the lists of the words in the query,
// the rarest first, and stops at a limit beyond which the remaining common words would add little. Scores
// weight words by term frequency and inverse document frequency (Nister and Stewenius 2006) over the
// keyframes that are stored at the time of the search, so the result does not depend on removed keyframes.
//
// All functions are thread-safe. Searches share a lock. A writer holds it exclusively for one keyframe at a
// time, which takes microseconds, and has priority over searches that begin later.
class InvertedFile {
 public:
  using Slot = std::uint32_t;  // The index of a keyframe while it is stored; reused after its removal.
  static constexpr Slot kNoSlot = 0xFFFFFFFFu;
  struct Owner {
    std::uint64_t map_key = 0;
    KeyFrameId keyframe = kNoId;
  };
  struct Hit {
    Slot slot = kNoSlot;
    Owner owner;
    // The similarity of the two tf-idf vectors, each normalized to sum 1: the sum of the minima over all
    // words. It is 1 for the same words in the same proportions and 0 for no common word. tf is the number of
    // times the word occurs in the image; idf is ln(1 + N / n) for a word that n of N keyframes contain.
    double score = 0;
  };
  struct Cost {
    std::size_t words = 0, postings = 0;  // The numbers that the search read.
  };

  InvertedFile();
  ~InvertedFile();

  Slot Add(const WordBag& bag, Owner owner);
  void Remove(Slot slot);
  std::size_t size() const;  // The number of keyframes.
  std::size_t postings() const;

  // Returns the `count` most similar keyframes, best first; ties go to the lower slot. Candidates are
  // selected with the rarest words first and then ranked with all words.
  std::vector<Hit> Search(const WordBag& wanted, std::size_t count, Cost* cost = nullptr) const;
  // Returns the scores of the given slots, in their order, computed with all words.
  std::vector<double> Scores(const WordBag& wanted, std::span<const Slot> slots) const;

 private:
  struct Scratch;
  class Weights;
  // A shared lock for searches, which lets a waiting writer go first.
  class ReadLock;
  std::vector<Slot> Shortlist(const WordBag& wanted, const Weights& weights, std::size_t count,
                              Cost* cost) const;
  std::unique_ptr<Scratch> TakeScratch() const;
  void ReturnScratch(std::unique_ptr<Scratch> scratch) const;

  mutable std::mutex writer_priority_mutex_;
  mutable std::shared_mutex mutex_;  // Guards the fields below.
  // For each word, slot << 4 | count - 1 of each keyframe that contains it, in no particular order.
  std::vector<std::vector<std::uint32_t>> lists_;
  std::vector<WordBag> bags_;           // By slot.
  std::vector<std::uint16_t> lengths_;  // By slot: the number of words, counting repetitions.
  std::vector<Owner> owners_;           // By slot.
  std::vector<Slot> free_;
  std::size_t postings_ = 0;

  mutable std::mutex scratch_mutex_;
  mutable std::vector<std::unique_ptr<Scratch>> scratch_;  // All zeros; one for each concurrent search.
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "types.hpp"

namespace sim_core {

/// Which 3×3 blocks of a structurally symmetric matrix are non-zero, and the order in which they are
/// eliminated. Constant; made once for a model.
///
/// The order is by minimum degree. On a tree it runs from the leaves to the root, makes no new blocks, and
/// costs O(N). A closed loop fills in a few blocks more and stays correct.
class BlockStructure {
  public:
    /// `couplings` are pairs of different block indices below `size`; repetition is allowed.
    BlockStructure(int size, const std::vector<std::pair<int, int>>& couplings);
    BlockStructure() : BlockStructure(0, {}) {}

    int size() const { return size_; }
    int slots() const { return slots_; }

    /// Where block (row, column) is stored; rows of the diagonal are slots 0 … size − 1.
    /// −1 if the block is structurally zero.
    int slot(int row, int column) const;

  private:
    friend class BlockSolver;

    struct Neighbour {
        int row;    ///< block eliminated later
        int lower;  ///< slot of (row, pivot)
        int upper;  ///< slot of (pivot, row)
    };

    int size_;
    int slots_;
    std::vector<int> order_;             ///< pivots
    std::vector<int> first_neighbour_;   ///< per position in the order, and one past the end
    std::vector<Neighbour> neighbours_;
    std::vector<int> first_update_;
    std::vector<int> updates_;           ///< slots (row_i, row_j), i outer, j inner
    std::vector<std::vector<std::pair<int, int>>> columns_;  ///< per row: (column, slot), sorted
};

/// Block LU factorisation on a fixed structure. No pivoting between blocks: the matrices solved here are
/// dominated by their mass terms.
class BlockSolver {
  public:
    explicit BlockSolver(const BlockStructure& structure)
        : structure_(&structure), blocks_(structure.slots()), inverse_(structure.size()) {}

    /// The matrix; overwritten by factor().
    std::vector<Mat3>& blocks() { return blocks_; }
    const std::vector<Mat3>& blocks() const { return blocks_; }

    void factor();

    /// Solves in place after factor().
    void solve(std::vector<Vec3>& x) const;

  private:
    const BlockStructure* structure_;
    std::vector<Mat3> blocks_;
    std::vector<Mat3> inverse_;  ///< of the pivots
};

}  // namespace sim_core

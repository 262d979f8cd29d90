// SPDX-License-Identifier: Apache-2.0
#include "block_solver.hpp"

#include <algorithm>
#include <map>
#include <set>

namespace sim_core {

BlockStructure::BlockStructure(int size, const std::vector<std::pair<int, int>>& couplings)
    : size_(size), slots_(size), columns_(size) {
    std::vector<std::set<int>> graph(size);
    std::map<std::pair<int, int>, int> slot_of;
    const auto connect = [&](int i, int j) {
        if (i == j || !graph[i].insert(j).second) return;
        graph[j].insert(i);
        slot_of[{i, j}] = slots_++;
        slot_of[{j, i}] = slots_++;
    };
    for (const auto& [i, j] : couplings) connect(i, j);

    std::set<std::pair<std::size_t, int>> by_degree;
    for (int i = 0; i < size; ++i) by_degree.insert({graph[i].size(), i});
    first_neighbour_.push_back(0);
    first_update_.push_back(0);
    while (!by_degree.empty()) {
        const int pivot = by_degree.begin()->second;
        by_degree.erase(by_degree.begin());
        order_.push_back(pivot);
        const std::set<int> later = graph[pivot];
        for (const int i : later) by_degree.erase({graph[i].size(), i});
        for (const int i : later) {
            neighbours_.push_back({i, slot_of.at({i, pivot}), slot_of.at({pivot, i})});
            for (const int j : later) connect(i, j);
            graph[i].erase(pivot);
        }
        for (const int i : later) {
            by_degree.insert({graph[i].size(), i});
            for (const int j : later) updates_.push_back(i == j ? i : slot_of.at({i, j}));
        }
        first_neighbour_.push_back(static_cast<int>(neighbours_.size()));
        first_update_.push_back(static_cast<int>(updates_.size()));
    }
    for (const auto& [index, slot] : slot_of) columns_[index.first].emplace_back(index.second, slot);
}

int BlockStructure::slot(int row, int column) const {
    if (row == column) return row;
    const auto& columns = columns_[row];
    const auto found = std::lower_bound(columns.begin(), columns.end(), std::pair{column, 0});
    return found != columns.end() && found->first == column ? found->second : -1;
}

void BlockSolver::factor() {
    const BlockStructure& s = *structure_;
    for (int p = 0; p < s.size_; ++p) {
        const int pivot = s.order_[p];
        const Mat3 inverse = blocks_[pivot].inverse();
        inverse_[pivot] = inverse;
        const int begin = s.first_neighbour_[p];
        const int end = s.first_neighbour_[p + 1];
        int update = s.first_update_[p];
        for (int i = begin; i < end; ++i) {
            Mat3& lower = blocks_[s.neighbours_[i].lower];
            const Mat3 multiplier = lower * inverse;
            lower = multiplier;
            for (int j = begin; j < end; ++j) {
                blocks_[s.updates_[update++]].noalias() -= multiplier * blocks_[s.neighbours_[j].upper];
            }
        }
    }
}

void BlockSolver::solve(std::vector<Vec3>& x) const {
    const BlockStructure& s = *structure_;
    for (int p = 0; p < s.size_; ++p) {
        const Vec3 value = x[s.order_[p]];
        for (int i = s.first_neighbour_[p]; i < s.first_neighbour_[p + 1]; ++i) {
            x[s.neighbours_[i].row].noalias() -= blocks_[s.neighbours_[i].lower] * value;
        }
    }
    for (int p = s.size_ - 1; p >= 0; --p) {
        const int pivot = s.order_[p];
        Vec3 value = x[pivot];
        for (int i = s.first_neighbour_[p]; i < s.first_neighbour_[p + 1]; ++i) {
            value.noalias() -= blocks_[s.neighbours_[i].upper] * x[s.neighbours_[i].row];
        }
        x[pivot].noalias() = inverse_[pivot] * value;
    }
}

}  // namespace sim_core

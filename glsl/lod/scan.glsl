// lod/scan.glsl — sums over the threads of one work group: for each thread, the sum of all threads before it.
//   Log-step scan (Hillis, Steele 1986, "Data parallel algorithms"):
//   in round i each thread adds the sum of the thread 2^i places before it.
//
//     4, 5, 14, 2   →   0, 4, 9, 23
//
// Provides SCANNERS, the threads of the group; sum_before(), sum_of_all().   Python twin: reference.sat

#define SCANNERS 256

shared uint s_sum[SCANNERS];

// Called once, by all threads of the group.
uint sum_before(int thread, uint own) {
    s_sum[thread] = own;
    for (int reach = 1; reach < SCANNERS; reach *= 2) {
        barrier();
        uint before = thread >= reach ? s_sum[thread - reach] : 0u;
        barrier();
        s_sum[thread] += before;
    }
    barrier();
    return s_sum[thread] - own;
}

uint sum_of_all() { return s_sum[SCANNERS - 1]; }

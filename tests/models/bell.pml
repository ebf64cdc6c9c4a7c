/* The bell of rt/futex.h beside the ring's number: a writer that may die before any of its steps and is started again,
 * readers that sleep, and that may die asleep or on the way there. All words are sequentially consistent in the code
 * (the number is stored before the bell's word by a release that the word's read-modify-write carries), so here steps
 * simply interleave. FUTEX_WAIT compares and lies down in one step; FUTEX_WAKE wakes whoever lies.
 *
 * Checked: once a ring that follows a message is complete nobody sleeps who has not seen the message, whichever writer
 * rang it and whoever died before: no wake-up is lost. A message whose writer died before it rang waits for the
 * successor's first ring, or the reader's own deadline. Each BROKEN_ variant must be found wanting. */
#ifndef READERS
#define READERS 2
#endif
#ifndef MESSAGES
#define MESSAGES 3
#endif
#ifndef DEATHS
#define DEATHS 2
#endif
#ifndef READER_DEATHS
#define READER_DEATHS 1
#endif

byte published = 0;                          /* of the ring */
byte bell = 0, arrivals = 0, served = 0;     /* of the bell */
byte seen[READERS];
bit asleep[READERS];
byte deaths = 0, reader_deaths = 0;

inline or_die() {
  if
  :: skip
  :: deaths < DEATHS -> deaths++; goto start
  fi
}

inline wake_all() {
  d_step { i = 0; do :: i < READERS -> asleep[i] = 0; i++ :: else -> break od; i = 0 }
}

inline nobody_sleeps_through() {
  d_step { i = 0; do :: i < READERS -> assert(!asleep[i] || seen[i] == published); i++ :: else -> break od; i = 0 }
}

active proctype Writer() {
  byte before, now, i;
start:
  before = 0; now = 0;
  do
  :: published < MESSAGES ->
     or_die(); published++;
     or_die(); before = arrivals;
     or_die(); bell++;
#ifdef BROKEN_LOOKS_BEFORE_RING
     now = before;
#else
     or_die(); now = arrivals;
#endif
#ifdef BROKEN_SERVES_LATE_ARRIVALS
     before = now;
#endif
     or_die();
     if
     :: now != served ->
#ifdef BROKEN_SERVED_FIRST
        served = before; or_die();
        atomic { wake_all(); nobody_sleeps_through() }
#else
        atomic { wake_all(); nobody_sleeps_through() };
        or_die();
        served = before
#endif
     :: else -> nobody_sleeps_through()
     fi;
     before = 0; now = 0
  :: else -> break
  od
}

active [READERS] proctype Reader() {
  byte word;
  byte me = _pid - 1;
start:
end:
  do
  :: 
#ifdef BROKEN_LOOKS_BEFORE_WORD
     if
     :: atomic { published > seen[me] -> seen[me] = published; goto start }
     :: atomic { published == seen[me] -> skip }
     fi;
     word = bell;
#else
     word = bell;
     if
     :: atomic { published > seen[me] -> seen[me] = published; goto start }
     :: atomic { published == seen[me] -> skip }
     fi;
#endif
#ifndef BROKEN_NO_ARRIVAL
     arrivals++;
#endif
     if
     :: skip
     :: atomic { reader_deaths < READER_DEATHS -> reader_deaths++; word = 0; goto start }   /* its successor begins anew */
     fi;
     if
     :: atomic { bell == word -> asleep[me] = 1 };
end_asleep:
        if
        :: !asleep[me] -> skip
        :: atomic { asleep[me] && reader_deaths < READER_DEATHS -> reader_deaths++; asleep[me] = 0; word = 0; goto start }
        fi
     :: atomic { bell != word -> skip }
     fi;
     word = 0
  od
}

#include "toile/fabric/card.h"
